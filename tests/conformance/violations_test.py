"""No violation hides another one: documents with two or three independent mistakes give every error
that each of the mistakes gives alone, and no other.

Where one mistake takes away what another one's check needs, the pair is in PREMISES, with the
reason: nothing else may go missing."""

import copy
import itertools
import json
import os
import random
import re
import subprocess
import unittest

from conformance.mistakes import FIRST, OF_FIRST, OF_SECOND, SECOND, catalogue, meet

BUILD = os.environ["SHADED_BUILD"]
SEED = 20240307
PAIRS = 10000
TRIPLES = 10000

# ---- What may go missing ----

# An error, and the places that may hide it: groups of the first are $1 in the second.
PREMISES = [
    # What a check needs is wrong itself.
    ("What a color is in the working space needs both spaces, and the whole color",
     r"too large to be converted|`color` times `intensity`|raw has no meaning",
     r"/workingSpace|/colorSpace|.*(color|background|ambient)/.*"),
    ("Which members a thing has is said by its type, a bare light's by its position",
     r"^(.*)/\w+: unknown member", r"$1/(type|position)"),
    ("Whether positions or a map must be there is said by the type",
     r"^(.*): the member \"(?:positions|map)\" is missing", r"$1/type"),
    ("The view needs both of its ends, and the camera's frame the view",
     r"^/camera/\w+: (position and target are|`up` is parallel)|in the camera frame",
     r"/camera/(position|target|up).*"),
    ("A region needs the picture's sides, its extents the corner",
     r"the region reaches out of the picture|a region is at least",
     r"/image/(width|height)|/image/region/(\d|length)"),
    ("How many samples there are is said by `samples`", r"limit `samples`", r"/image/samples"),
    ("What a light's position means is said by its type, its w is the last of four",
     r"^(/lights/\d)(/position)?: .*(infinity|finite|zero|no position|not both|needs a `type`|far)",
     r"$1/(type|frame|position.*)"),
    ("Only planes have no faces", r"^(/objects/\d): an infinite plane", r"$1/type"),
    ("An object's size with its transform needs the shape, all of the size, and an inverse",
     r"^(/objects/\d): the object's size",
     r"$1/(type|radius|height|transform|transform/(scale|matrix))"),
    ("The rows of a matrix need 16 items, its inverse numbers",
     r"^(.*/matrix): (the transform has no|the last row)", r"$1/(\d+|length)"),
    ("Indices and normals are counted against positions",
     r"^(/objects/\d|/meshes/\w+)/(indices|normals).*: (an index|# more indices|expected as many)",
     r"$1/positions.*"),
    ("What a format holds is said by the format, and how deep by bitDepth",
     r"cannot hold|has no layers|FORMAT picture is at most",
     r"/output(s/\d)?(/format|/bitDepth|)"),
    ("A normal is zero as a whole", r"^(.*/normals)/\d+: the normal", r"$1/\d+"),
    ("A view is one of its display", r"^(.*)/view: .* has no view", r"$1/display"),
    ("Channels are those of the space, and layers must be light in it",
     r"^(.*)/(channel|layers): (this output has no channel|layers are light)", r"$1/colorSpace"),
    ("Names of materials may be any where `materials` is no object",
     r"there is no material", r"/materials"),
    ("Names of meshes may be any where `meshes` is no object", r"there is no mesh", r"/meshes"),
    ("How many lights there are needs `lights` to be an array", r"there is no light", r"/lights"),
    ("Whether a light's `up` is parallel needs its direction",
     r"^(/lights/\d+)/up: `up` is parallel", r"$1/(direction|type)(/\d)?"),
    ("Which members a material and its lobes have needs the model",
     r"^(/materials/\w+)(?:/\w+)+: (unknown member|must be|expected)", r"$1/model"),
    # The other mistake mends it.
    ("A name that is another one's no longer", r"is taken by output", r"/outputs/\d(/name)?"),
    ("A layer that is there once, or not at all",
     r"^(.*): (the layer .* is there twice|layers are light)", r"$1(/\d)?"),
    ("A metric that has its error", r"`metric` needs", r"/accuracy/maxError"),
]


def pointer(path):
    return "".join(f"/{key}" for key in path)


def may_hide(slots, error):
    """The premises that let mistakes at these places hide an error."""
    text = ": ".join(error)
    places_ = [pointer(slot) for slot in slots]
    # The place of the error is gone.
    if any((error[0] + "/").startswith(place + "/") for place in places_):
        return {"gone"}
    found = set()
    for reason, words, where in PREMISES:
        match = re.search(words, text)
        if match:
            thing = re.escape(match.group(1)) if match.groups() and match.group(1) else ""
            if any(re.fullmatch(where.replace("$1", thing), place) for place in places_):
                found.add(reason)
    return found


# ---- Answers ----


def read(documents):
    """The reader's errors for each document, as sets."""
    lines = "".join(json.dumps(document) + "\n" for document in documents)
    done = subprocess.run([os.path.join(BUILD, "tests", "check_many")], input=lines, text=True,
                          capture_output=True, check=True)
    return [{(place, essence(detail)) for place, detail in json.loads(line)["errors"]}
            for line in done.stdout.splitlines()]


def essence(detail):
    """Without what other mistakes may change: numbers, names to choose from, the kind of thing."""
    detail = re.sub(r": (there is|did you mean|it holds) .*|bitDepth \w+|(?<=which has )at most ", "", detail)
    detail = re.sub(r'^(unknown member "\w+") of .*', r"\1", detail)
    detail = re.sub(r"\b(png|jpeg|webp|tiff|exr|hdr)\b", "FORMAT", detail)
    detail = re.sub(r"\d[\d.e+]*", "#", detail)
    return re.sub(r"from # to #", "from #", detail)


def make(document, mistakes):
    document = copy.deepcopy(document)
    for mistake in mistakes:
        mistake.make(document)
    return document


def independent(mistakes):
    return not any(meet(a, b) for a, b in itertools.combinations(mistakes, 2))


class Violations(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.catalogues = []
        for document, written in ((FIRST, OF_FIRST), (SECOND, OF_SECOND)):
            mistakes = list(catalogue(document, written))
            for mistake, errors in zip(mistakes, read([make(document, [m]) for m in mistakes])):
                mistake.errors = errors
            cls.catalogues.append((document, mistakes, len(written)))

    def test_each_mistake_is_one(self):
        for document, mistakes, _ in self.catalogues:
            self.assertEqual(read([document]), [set()])
            for mistake in mistakes:
                self.assertTrue(mistake.errors, mistake.name)

    def test_two_mistakes_give_the_errors_of_both(self):
        """All pairs of what is written above, and some of the others."""
        chance, used = random.Random(SEED), set()
        for document, mistakes, written in self.catalogues:
            pairs = list(itertools.combinations(mistakes[:written], 2))
            pairs += [chance.sample(mistakes, 2) for _ in range(PAIRS)]
            used |= self.check(document, pairs)
        unused = {reason for reason, _, _ in PREMISES} - used
        self.assertEqual(unused, set(), "premises that nothing needs")

    def test_three_mistakes_give_the_errors_of_all(self):
        chance = random.Random(SEED + 1)
        for document, mistakes, _ in self.catalogues:
            self.check(document, [chance.sample(mistakes, 3) for _ in range(TRIPLES)])

    def check(self, document, groups):
        """The premises that were needed."""
        groups, used = [group for group in groups if independent(group)], set()
        self.assertGreater(len(groups), 400)
        for group, found in zip(groups, read([make(document, group) for group in groups])):
            names = " + ".join(mistake.name for mistake in group)
            for mistake in group:
                others = set().union(*(m.slots for m in group if m is not mistake))
                for error in mistake.errors - found:
                    reasons = may_hide(others, error)
                    self.assertTrue(reasons, f"{names}: {error} is hidden")
                    used |= reasons
            more = found - set().union(*(mistake.errors for mistake in group))
            self.assertEqual(more, set(), f"{names}: more than each alone")
        return used


if __name__ == "__main__":
    unittest.main()
