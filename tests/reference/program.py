"""Runs the built `shade` and reads its pictures."""

import json
import os
import subprocess
import tempfile

import numpy as np

BUILD = os.environ.get("SHADED_BUILD", "build")
SOURCE = os.environ.get("SHADED_SOURCE", ".")


def shade(document):
    """The bytes that `shade render` writes for a scene document."""
    run = subprocess.run([os.path.join(BUILD, "shade"), "render", "-", "-o", "-"],
                         input=json.dumps(document).encode(), stdout=subprocess.PIPE,
                         stderr=subprocess.PIPE, check=False, timeout=120)
    if run.returncode:
        raise AssertionError(f"shade exits {run.returncode}: {run.stderr.decode()[:2000]}")
    return run.stdout


def read(data, suffix):
    """Samples of a picture's bytes as [h,w,channels] floats, and the channels' names. Integer
    samples come as codes."""
    import OpenImageIO as oiio
    with tempfile.NamedTemporaryFile(suffix="." + suffix) as file:
        file.write(data)
        file.flush()
        picture = oiio.ImageInput.open(file.name)
        if picture is None:
            raise AssertionError(f"not a picture: {oiio.geterror()}")
        spec = picture.spec()
        kind = {"uint8": oiio.UINT8, "uint16": oiio.UINT16}.get(str(spec.format), oiio.FLOAT)
        pixels = picture.read_image(0, 0, 0, spec.nchannels, kind)
        picture.close()
    samples = np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)
    return samples.astype(np.float64), list(spec.channelnames)


def linear(document, tier="exact", layers=None):
    """A scene as linear Rec.709 floats: {channel name: [h,w]}."""
    output = {"format": "exr", "bitDepth": "float", "colorSpace": "lin_rec709"}
    if layers:
        output["layers"] = layers
    samples, names = read(shade({**document, "accuracy": {"tier": tier}, "output": output}), "exr")
    return {name: samples[..., i] for i, name in enumerate(names)}


def rgb(channels):
    return np.stack([channels[name] for name in "RGB"], -1)


def codes(document, **output):
    """A scene as 8-bit (or bitDepth 16) codes [h,w,channels] from a PNG."""
    output = {"format": "png", **output}
    return read(shade({**document, "output": output}), "png")[0].astype(np.int64)
