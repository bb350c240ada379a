"""What the documents say is there: what they link to, and the figures that README shows."""

import os
import re
import unittest
from pathlib import Path

SOURCE = Path(os.environ["SHADED_SOURCE"])

LINK = re.compile(r"\]\(([^)\s]+)\)|<img src=\"([^\"]+)\"")
FIGURE = re.compile(r"\d[\d,]*(?:\.\d+)?")


def documents():
    """All of ours, but for the templates of tests/bench."""
    return [path for path in sorted(SOURCE.rglob("*.md"))
            if not any(part.startswith((".", "build", "node_modules", "bench"))
                       for part in path.relative_to(SOURCE).parent.parts)
            or path.is_relative_to(SOURCE / "docs")]


def links(path):
    """What a document links to, below SOURCE."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    for groups in LINK.findall(text):
        target = "".join(groups).split("#")[0]
        if target and "://" not in target:
            yield target, (path.parent / target).resolve()


def figures(text):
    return {figure.replace(",", "") for figure in FIGURE.findall(text)}


class Documents(unittest.TestCase):
    def test_links_lead_somewhere(self):
        self.assertGreater(len(documents()), 12)
        for path in documents():
            for target, file in links(path):
                with self.subTest(document=str(path.relative_to(SOURCE)), target=target):
                    self.assertTrue(file.exists())

    def test_readme_leads_to_every_document(self):
        reached, ahead = set(), [SOURCE / "README.md"]
        while ahead:
            path = ahead.pop()
            if path not in reached:
                reached.add(path)
                ahead += [file for _, file in links(path) if file.suffix == ".md" and file.exists()]
        self.assertEqual(set(documents()) - reached, set())

    def test_architecture_names_files_that_are_there(self):
        text = (SOURCE / "ARCHITECTURE.md").read_text(encoding="utf-8")
        names = set(re.findall(r"`([\w./*-]+\.(?:c|h|cpp|py|yaml|conf|ocio))`", text))
        self.assertGreater(len(names), 90)
        for name in sorted(names):
            with self.subTest(file=name):
                folder = "src/**/" if "/" not in name else ""
                self.assertTrue(list(SOURCE.glob(folder + name))
                                or list((SOURCE / "src").glob(name)))

    def test_readme_takes_a_minute(self):
        text = (SOURCE / "README.md").read_text(encoding="utf-8")
        words = re.sub(r"\]\([^)]*\)|<[^>]*>|^    .*$", "", text, flags=re.M).split()
        self.assertLess(len([word for word in words if re.search(r"\w", word)]), 400)

    def test_figures_of_the_readme_are_those_of_the_pages(self):
        """A row of figures names the command and the page that it writes."""
        text = (SOURCE / "README.md").read_text(encoding="utf-8")
        rows = re.findall(r"^\|([^|]*)\|([^|]*)\| `(\./dev [^`]*)` \(\[figures\]\(([^)]*)\)\) \|$",
                          text, re.M)
        self.assertEqual(len(rows), 3)
        for _, claim, command, page in rows:
            there = (SOURCE / page).read_text(encoding="utf-8")
            with self.subTest(page=page):
                self.assertIn(command.split()[1], there)
                self.assertGreater(len(figures(claim)), 1)
                self.assertEqual(figures(claim + command) - figures(there), set(),
                                 f"README says something else than {page}")


if __name__ == "__main__":
    unittest.main()
