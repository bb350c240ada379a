"""A part of what `./dev color` measures, on each run, and that its page has all of it."""

import unittest

from golden import color_table as table


class Table(unittest.TestCase):
    def test_files_hold_what_ocioconvert_makes(self):
        for target in (("Linear Rec.2020",), ("CIE-XYZ-D65",), ("YIQ",), ("HSV",), ("CIELAB D50",), ("OKLab",),
                       ("LCh D50",), ("OKLCh",),
                       ("sRGB", "ACES 1.0 - SDR Video"), ("Display P3", "Standard"), ("P3-D65", "ACES 1.0 - SDR Cinema"),
                       ("Rec.2100-PQ", "ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)"), ("Rec.2100-HLG", "Standard"),
                       ("ST2084-P3-D65", "Raw")):
            for column, figure in table.row(target).items():
                self.assertLessEqual(figure, table.LIMITS[column], (target, column))

    def test_page_has_every_space_and_view(self):
        page = table.PAGE.read_text()
        for target in [(space,) for space in table.SPACES] + table.VIEWS:
            self.assertIn(f"\n| {' / '.join(target)} | ", page)


if __name__ == "__main__":
    unittest.main()
