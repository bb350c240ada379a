"""Pictures of every format read back by programs that shaded has no part in: Pillow (libpng,
libjpeg, libwebp, libtiff, LittleCMS) and OpenImageIO's reader."""

import io
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy
import OpenImageIO as oiio
from PIL import Image, ImageCms, JpegImagePlugin

BUILD = os.environ["SHADED_BUILD"]
WRITER = os.path.join(BUILD, "image_writer")
WIDTH, HEIGHT = 32, 16

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290)
ACESCG = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767)


def pattern(alpha=False, width=WIDTH, height=HEIGHT):
    """What image_writer paints."""
    y, x = numpy.mgrid[0:height, 0:width]
    u, v = x / width, y / height
    a = (x + y) % 5 / 4 if alpha else numpy.ones_like(u)
    return numpy.stack([u, v, 0.25 + 0.5 * u * v, a], axis=-1)


def codes(values, top=255):
    return numpy.floor(numpy.clip(values, 0, 1) * top + 0.5)


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.writer = subprocess.Popen([WRITER], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                      text=True)

    @classmethod
    def tearDownClass(cls):
        cls.writer.communicate(timeout=500)
        if cls.writer.returncode:
            raise AssertionError(f"the writer exits {cls.writer.returncode}")

    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def write(self, suffix, **options):
        path = os.path.join(self.folder, "picture." + suffix)
        words = [path, *(f"{key}={value}" for key, value in options.items())]
        self.writer.stdin.write(" ".join(words) + "\n")
        self.writer.stdin.flush()
        self.assertEqual(self.writer.stdout.readline(), "0\n", words)
        return path

    def pillow(self, suffix, **options):
        with Image.open(self.write(suffix, **options)) as image:
            image.load()
            return image

    def pixels(self, suffix, **options):
        return numpy.asarray(self.pillow(suffix, **options)).astype(float)

    def oiio(self, suffix, **options):
        """Spec and pixels as stored: no conversion of alpha."""
        path = self.write(suffix, **options)
        config = oiio.ImageSpec()
        config.attribute("oiio:UnassociatedAlpha", 1)
        source = oiio.ImageInput.open(path, config)
        self.assertIsNotNone(source, oiio.geterror())
        spec = source.spec()
        kind = "float" if str(spec.format) in ("half", "float") else str(spec.format)
        pixels = source.read_image(0, 0, 0, spec.nchannels, kind)
        source.close()
        return spec, pixels.astype(float)


class EightBits(Case):
    def test_png_and_tiff_give_back_every_code(self):
        for suffix in ("png", "tiff"):
            self.assertEqual(self.pillow(suffix).mode, "RGB")
            numpy.testing.assert_array_equal(self.pixels(suffix), codes(pattern()[..., :3]))

    def test_png_alpha_is_straight(self):
        numpy.testing.assert_array_equal(self.pixels("png", alpha=1), codes(pattern(True)))

    def test_webp_alpha_is_straight_and_lossless_at_quality_100(self):
        self.assertEqual(self.pillow("webp", alpha=1).mode, "RGBA")
        numpy.testing.assert_array_equal(self.pixels("webp", quality=100, alpha=1),
                                         codes(pattern(True)))
        numpy.testing.assert_array_equal(self.pixels("webp", quality=100),
                                         codes(pattern()[..., :3]))

    def test_lossy_webp_keeps_alpha_exact_and_color_close(self):
        # 5 x 5 blocks of alpha make it hard; color is compared on a larger, opaque picture, where
        # libwebp at quality 95 stays within a few codes of a smooth gradient.
        got = self.pixels("webp", quality=95, alpha=1)
        numpy.testing.assert_array_equal(got[..., 3], codes(pattern(True)[..., 3]))
        got = self.pixels("webp", quality=95, size="256x256")
        self.assertLess(abs(got - codes(pattern(width=256, height=256)[..., :3])).max(), 8)

    def test_tiff_alpha_is_associated_in_the_encoded_value(self):
        spec, got = self.oiio("tiff", alpha=1)
        want = pattern(True)
        want[..., :3] *= want[..., 3:]
        numpy.testing.assert_array_equal(got, codes(want))
        self.assertEqual(spec.get_int_attribute("oiio:UnassociatedAlpha", 0), 0)
        with Image.open(self.write("tiff", alpha=1)) as image:
            self.assertEqual(image.tag_v2[338], (1,))  # ExtraSamples: associated alpha

    def test_jpeg_is_close_and_subsampled_below_quality_90(self):
        # Rounding to YCbCr and back alone costs up to 3 codes.
        for quality, bound in ((100, 5), (90, 6), (60, 16)):
            got = self.pixels("jpg", quality=quality, size="256x256")
            want = codes(pattern(width=256, height=256)[..., :3])
            self.assertLess(abs(got - want).max(), bound, quality)
        for quality, sampling in ((90, 0), (89, 2)):  # Pillow: 0 is 4:4:4, 2 is 4:2:0
            path = self.write("jpg", quality=quality)
            with Image.open(path) as image:
                self.assertEqual(JpegImagePlugin.get_sampling(image), sampling)

    def test_one_channel_is_grey(self):
        for channel in range(3):
            want = codes(pattern()[..., channel])
            for suffix in ("png", "tiff"):
                self.assertEqual(self.pillow(suffix, channel=channel).mode, "L")
                numpy.testing.assert_array_equal(self.pixels(suffix, channel=channel), want)
            self.assertEqual(self.pillow("jpg", channel=channel).mode, "L")
            got = self.pixels("webp", channel=channel, quality=100)
            numpy.testing.assert_array_equal(got, numpy.repeat(want[..., None], 3, axis=-1))

    def test_grey_keeps_alpha_and_alpha_can_be_the_grey(self):
        want = codes(pattern(True)[..., [1, 3]])
        self.assertEqual(self.pillow("png", channel=1, alpha=1).mode, "LA")
        numpy.testing.assert_array_equal(self.pixels("png", channel=1, alpha=1), want)
        got = self.pixels("webp", channel=1, alpha=1, quality=100)
        numpy.testing.assert_array_equal(got[..., [0, 3]], want)
        for suffix in ("png", "tiff"):
            numpy.testing.assert_array_equal(self.pixels(suffix, channel=3, alpha=1),
                                             want[..., 1])

    def test_files_say_what_their_channels_are(self):
        about = "YIQ: luma, in-phase, quadrature \u00b1"
        options = {"space": "YIQ", "transfer": "unknown"}
        self.assertEqual(self.pillow("png", **options).text["Description"], about)
        for suffix in "jpg", "webp":
            told = self.pillow(suffix, **options).getexif()[0x010E]
            self.assertEqual(told.encode("latin-1").decode(), about)
        for suffix, depth in ("tiff", 8), ("tiff", "float"), ("exr", "half"):
            spec, _ = self.oiio(suffix, depth=depth, **options)
            self.assertEqual(spec.get_string_attribute("ImageDescription"), about)
        for suffix in "png", "jpg", "webp":
            image = self.pillow(suffix)
            self.assertNotIn("Description", getattr(image, "text", {}))
            self.assertNotIn(0x010E, image.getexif())


class SixteenBits(Case):
    def test_png_and_tiff_give_back_every_code(self):
        for suffix in ("png", "tiff"):
            spec, got = self.oiio(suffix, depth=16)
            self.assertEqual(str(spec.format), "uint16")
            numpy.testing.assert_array_equal(got, codes(pattern()[..., :3], 65535))

    def test_alpha_is_as_the_format_wants_it(self):
        _, got = self.oiio("png", depth=16, alpha=1)
        numpy.testing.assert_array_equal(got, codes(pattern(True), 65535))
        _, got = self.oiio("tiff", depth=16, alpha=1)
        want = pattern(True)
        want[..., :3] *= want[..., 3:]
        numpy.testing.assert_array_equal(got, codes(want, 65535))


class Floats(Case):
    def test_exr_and_tiff_keep_f32_bit_for_bit(self):
        for suffix in ("exr", "tiff"):
            spec, got = self.oiio(suffix, depth="float")
            self.assertEqual(str(spec.format), "float")
            numpy.testing.assert_array_equal(got, pattern()[..., :3].astype(numpy.float32))

    def test_half_is_rounded_to_nearest(self):
        for suffix in ("exr", "tiff"):
            spec, got = self.oiio(suffix, depth="half")
            self.assertEqual(str(spec.format), "half", suffix)
            numpy.testing.assert_array_equal(got, pattern()[..., :3].astype(numpy.float16))

    def test_color_is_premultiplied(self):
        want = pattern(True)
        want[..., :3] *= want[..., 3:]
        for suffix in ("exr", "tiff"):
            spec, got = self.oiio(suffix, depth="float", alpha=1)
            self.assertEqual(spec.alpha_channel, 3)
            numpy.testing.assert_array_equal(got, want.astype(numpy.float32))

    def test_hdr_holds_eight_bits_of_mantissa(self):
        spec, got = self.oiio("hdr", transfer="linear")
        want = pattern()[..., :3]
        # A shared exponent: a code is at most 1/128 of the largest channel.
        self.assertLess((abs(got - want) / want.max(axis=-1, keepdims=True)).max(), 1 / 128)
        _, grey = self.oiio("hdr", channel=0)
        self.assertEqual(grey.shape[2], 3)
        numpy.testing.assert_array_equal(grey[..., 0], grey[..., 2])

    def test_floats_are_signed_and_unpacked(self):
        _, got = self.oiio("exr", depth="float", space="YIQ", transfer="unknown")
        numpy.testing.assert_array_equal(got, pattern()[..., :3].astype(numpy.float32))


class Exr(Case):
    def test_names_and_types_of_layers(self):
        spec, got = self.oiio("exr", depth="half", alpha=1, layers=1)
        names = list(spec.channelnames)
        self.assertEqual(names, ["R", "G", "B", "A", "depth.Z", "diffuse.R", "diffuse.G",
                                 "diffuse.B", "diffuse.A", "light.0.Z"])
        types = dict(zip(names, (str(f) for f in spec.channelformats)))
        self.assertEqual(types.pop("depth.Z"), "float")
        self.assertEqual(set(types.values()), {"half"})

        y, x = numpy.mgrid[0:HEIGHT, 0:WIDTH]
        depth = 1e6 + y * WIDTH + x
        by_name = {name: got[..., i] for i, name in enumerate(names)}
        numpy.testing.assert_array_equal(by_name["depth.Z"], depth.astype(numpy.float32))
        numpy.testing.assert_array_equal(by_name["light.0.Z"], numpy.full_like(depth, 65504))
        source = pattern(True)
        numpy.testing.assert_array_equal(by_name["diffuse.G"], source[..., 1].astype("f2"))
        numpy.testing.assert_array_equal(by_name["G"],
                                         (source[..., 1] * source[..., 3]).astype("f2"))

    def test_float_pictures_have_float_layers(self):
        spec, _ = self.oiio("exr", depth="float", layers=1)
        self.assertEqual({str(f) for f in spec.channelformats} | {str(spec.format)}, {"float"})

    def test_long_lines_come_back_from_tiles(self):
        for suffix in ("exr", "tiff"):
            for width, height in ((50000, 3), (45000, 70)):
                spec, got = self.oiio(suffix, depth="float", size=f"{width}x{height}")
                self.assertGreater(spec.tile_width, 0)
                want = pattern(width=width, height=height)[..., :3]
                numpy.testing.assert_allclose(got, want, rtol=2e-7)  # the writer has floats

    def test_layers_come_back_from_tiles(self):
        width, height = 45000, 20
        spec, got = self.oiio("exr", depth="half", layers=1, size=f"{width}x{height}")
        self.assertGreater(spec.tile_width, 0)
        names = list(spec.channelnames)
        y, x = numpy.mgrid[0:height, 0:width]
        want = (1e6 + y * width + x).astype(numpy.float32)
        numpy.testing.assert_array_equal(got[..., names.index("depth.Z")], want)
        green = pattern(width=width, height=height)[..., 1].astype("f4").astype("f2")
        numpy.testing.assert_array_equal(got[..., names.index("diffuse.G")], green)

    def test_one_file_one_part_and_nothing_on_disk(self):
        self.write("exr", layers=1)
        self.assertEqual(os.listdir(self.folder), ["picture.exr"])
        self.assertFalse(os.path.exists("memory.exr"))

    def test_chromaticities_are_those_of_linear_color(self):
        for name, xy in (("rec709", REC709), ("acescg", ACESCG), ("aces", ACES)):
            spec, _ = self.oiio("exr", transfer="linear", primaries=name)
            got = spec.getattribute("chromaticities")
            numpy.testing.assert_allclose(got, xy, atol=1e-7)
        for options in ({"transfer": "srgb"}, {"transfer": "linear", "primaries": "none"},
                        {"transfer": "linear", "channel": 0}):
            spec, _ = self.oiio("exr", **options)
            self.assertIsNone(spec.getattribute("chromaticities"), options)

    def test_color_spaces_are_named(self):
        for name, interop in (("rec709", "lin_rec709_scene"), ("acescg", "lin_ap1_scene"),
                              ("aces", "lin_ap0_scene"), ("p3", "lin_p3d65_scene")):
            spec, _ = self.oiio("exr", transfer="linear", primaries=name, named="house")
            self.assertEqual(spec.get_string_attribute("colorInteropID"), interop)
            self.assertEqual(spec.get_string_attribute("shaded:colorSpace"), "house")
        spec, _ = self.oiio("exr", transfer="srgb")
        self.assertEqual(spec.get_string_attribute("colorInteropID"), "")

    def test_radiance_tells_its_primaries(self):
        def header(**options):
            with open(self.write("hdr", **options), "rb") as file:
                return file.read().split(b"\n\n")[0].decode().splitlines()

        for name, xy in (("rec709", REC709), ("acescg", ACESCG), ("aces", ACES)):
            told = [line for line in header(transfer="linear", primaries=name)
                    if line.startswith("PRIMARIES=")]
            self.assertEqual([float(v) for v in told[0].split()[1:]], list(xy))
        plain = header(transfer="linear", primaries="none")
        self.assertFalse([line for line in plain if line.startswith("PRIMARIES=")])
        # The pixels are still where they were.
        numpy.testing.assert_array_equal(self.oiio("hdr", transfer="linear")[1],
                                         self.oiio("hdr", transfer="srgb")[1])

    def test_other_spaces_are_named(self):
        for options, names, shown in (
                ({}, ["R", "G", "B"], ""),
                ({"space": "YIQ"}, ["R", "G", "B"], "YIQ"),
                ({"space": "HSV", "channel": 0}, ["Y"], "H"),
                ({"channel": 1, "alpha": 1}, ["Y", "A"], "G"),
                ({"channel": 3, "alpha": 1}, ["Y"], "A")):
            spec, _ = self.oiio("exr", **options)
            self.assertEqual(sorted(spec.channelnames), sorted(names))
            self.assertEqual(spec.get_string_attribute("shaded:channels"), shown)


class Profiles(Case):
    """LittleCMS opens the profiles and finds the primaries in them."""

    def profile(self, suffix, **options):
        if suffix == "tiff":
            with Image.open(self.write(suffix, **options)) as image:
                data = image.tag_v2.get(34675)
        else:
            data = self.pillow(suffix, **options).info.get("icc_profile")
        return data and ImageCms.ImageCmsProfile(io.BytesIO(data))

    def check_primaries(self, profile, xy):
        core = profile.profile
        self.assertEqual(core.xcolor_space.strip(), "RGB")
        # chromaticities of what the colorants are before their adaptation to D50
        chad = numpy.array(core.chromatic_adaptation[0])
        columns = [numpy.linalg.solve(chad, c[0])
                   for c in (core.red_colorant, core.green_colorant, core.blue_colorant)]
        for i, xyz in enumerate([*columns, sum(columns)]):
            # colorants have 16 fractional bits
            self.assertAlmostEqual(xyz[0] / sum(xyz), xy[2 * i], delta=2e-4)
            self.assertAlmostEqual(xyz[1] / sum(xyz), xy[2 * i + 1], delta=2e-4)
        total = sum(numpy.array(c[0])
                    for c in (core.red_colorant, core.green_colorant, core.blue_colorant))
        numpy.testing.assert_array_equal(total, [0xF6D6 / 65536, 1, 0xD32D / 65536])

    def test_display_p3_is_in_every_format_that_shows_it(self):
        for suffix in ("png", "jpg", "webp", "tiff"):
            profile = self.profile(suffix, primaries="p3")
            self.assertIsNotNone(profile, suffix)
            self.check_primaries(profile, P3)
            self.assertEqual(ImageCms.getProfileDescription(profile).strip(), "Display P3")

    def test_srgb_has_a_profile_where_no_chunk_says_it(self):
        self.assertIsNone(self.profile("png"))
        for suffix in ("jpg", "webp", "tiff"):
            profile = self.profile(suffix)
            self.check_primaries(profile, REC709)
            self.assertEqual(ImageCms.getProfileDescription(profile).strip(), "sRGB")

    def test_every_transfer_and_primaries_open(self):
        for transfer in ("linear", "srgb", "rec1886"):
            for name, xy in (("rec709", REC709), ("p3", P3), ("acescg", ACESCG), ("aces", ACES)):
                self.check_primaries(self.profile("tiff", transfer=transfer, primaries=name), xy)

    def test_the_srgb_profile_is_the_srgb_of_littlecms(self):
        mine, theirs = self.profile("tiff"), ImageCms.createProfile("sRGB")
        ramp = Image.fromarray(numpy.random.default_rng(1).integers(0, 256, (64, 64, 3), "u1"))
        there = ImageCms.profileToProfile(ramp, mine, theirs, renderingIntent=1)
        difference = numpy.asarray(there).astype(int) - numpy.asarray(ramp)
        self.assertLessEqual(abs(difference).max(), 1)

    def test_display_p3_red_is_outside_srgb_and_greys_stay_grey(self):
        mine, theirs = self.profile("png", primaries="p3"), ImageCms.createProfile("sRGB")
        source = Image.fromarray(numpy.array([[[128, 128, 128], [200, 128, 128]]], "u1"))
        there = numpy.asarray(ImageCms.profileToProfile(source, mine, theirs, renderingIntent=1))
        numpy.testing.assert_allclose(there[0, 0], 128, atol=1)
        # 200/128/128 by hand: P3 linear to sRGB linear with the matrix of CSS Color 4, 12.
        linear = [((c / 255 + 0.055) / 1.055) ** 2.4 for c in (200, 128, 128)]
        matrix = [[1.2249401763, -0.2249401763, 0], [-0.0420569547, 1.0420569547, 0],
                  [-0.0196375546, -0.0786360456, 1.0982736001]]
        want = [255 * (1.055 * c ** (1 / 2.4) - 0.055) for c in numpy.dot(matrix, linear)]
        numpy.testing.assert_allclose(there[0, 1], want, atol=1.5)

    def test_unknown_color_is_left_unsaid(self):
        for suffix in ("png", "jpg", "webp", "tiff"):
            self.assertIsNone(self.profile(suffix, transfer="unknown"), suffix)
        info = self.pillow("png", transfer="unknown").info
        self.assertFalse({"gamma", "srgb", "chromaticity", "icc_profile"} & set(info))


class Files(Case):
    def test_no_dates_and_no_program_names(self):
        for suffix in ("png", "jpg", "webp", "tiff", "exr", "hdr"):
            with open(self.write(suffix), "rb") as file:
                data = file.read()
            self.assertIsNone(re.search(rb"20[0-9][0-9][:-][01]", data), suffix)
            self.assertNotIn(b"OpenImageIO", data)
            self.assertNotIn(b"capDate", data)
        with Image.open(self.write("tiff")) as image:
            self.assertNotIn(306, image.tag_v2)  # DateTime
            self.assertNotIn(305, image.tag_v2)  # Software

    def test_threads_give_the_same_bytes(self):
        for suffix in ("png", "jpg", "webp", "tiff", "exr", "hdr"):
            self.write(suffix, threads=4, repeat=8)  # the writer compares

    def test_a_missing_module_is_said_and_hurts_only_its_formats(self):
        # The writer's run path is its own folder: away from it the module is not found.
        lonely = os.path.join(self.folder, "image_writer")
        shutil.copy(WRITER, lonely)
        for suffix, works in (("png", True), ("jpg", True), ("webp", True), ("exr", False)):
            out = os.path.join(self.folder, "lonely." + suffix)
            done = subprocess.run([lonely, out], capture_output=True, text=True, timeout=500)
            self.assertEqual(done.returncode, 0 if works else 1, done.stderr)
            if not works:
                self.assertIn("shaded_oiio.so", done.stderr)
                self.assertFalse(os.path.exists(out))

    def test_tiff_is_readable_where_its_size_is_odd(self):
        for size in ("1x1", "3x1", "1x7", "129x65"):
            width, height = map(int, size.split("x"))
            got = self.pixels("tiff", size=size)
            numpy.testing.assert_array_equal(
                got, codes(pattern(width=width, height=height)[..., :3]))


if __name__ == "__main__":
    unittest.main()
