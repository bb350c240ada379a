"""Renders with the built daemon, one for all of a test's pictures, and reads them."""

import atexit
import json
import os
import tempfile
import threading

import numpy as np

BUILD = os.environ.get("SHADED_BUILD", "build")
SOURCE = os.environ.get("SHADED_SOURCE", ".")


_running = []
_starting = threading.Lock()


def _daemon():
    """Programs that do not render need no daemon, nor what starts one."""
    from e2e.daemon import Daemon
    with _starting:
        if not _running:
            _running.append(Daemon("--reuse", "0", "--response-cache", "0", "--timeout", "300",
                                   "--log-requests", "off"))
            atexit.register(_running[0].stop)
    return _running[0]


def shade(document):
    """The bytes of the picture of a scene document."""
    answer = _daemon().render(document)
    if answer.status != 200:
        raise AssertionError(f"{answer.status}: {answer.body.decode()[:2000]}")
    return answer.body


def ask(path, document):
    """The body of another path's answer to a scene document."""
    answer = _daemon().post(path, document)
    if answer.status != 200:
        raise AssertionError(f"{answer.status}: {answer.body.decode()[:2000]}")
    return answer.body


def read(data, suffix):
    """Samples of a picture's bytes as [h,w,channels] floats, and the channels' names. Integer
    samples come as codes, multiplied by alpha where the picture has one."""
    import OpenImageIO as oiio
    # In which light versions of OpenImageIO multiply differs, so that it is done here.
    as_they_are = oiio.ImageSpec()
    as_they_are.attribute("oiio:UnassociatedAlpha", 1)
    with tempfile.NamedTemporaryFile(suffix="." + suffix) as file:
        file.write(data)
        file.flush()
        picture = oiio.ImageInput.open(file.name, as_they_are if suffix == "png" else oiio.ImageSpec())
        if picture is None:
            raise AssertionError(f"not a picture: {oiio.geterror()}")
        spec = picture.spec()
        kind = {"uint8": oiio.UINT8, "uint16": oiio.UINT16}.get(str(spec.format), oiio.FLOAT)
        pixels = picture.read_image(0, 0, 0, spec.nchannels, kind)
        picture.close()
    samples = np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels).astype(np.float64)
    if suffix == "png" and spec.alpha_channel >= 0:
        most = 65535 if kind == oiio.UINT16 else 255
        samples[..., :-1] = np.floor(samples[..., :-1] * samples[..., -1:] / most)
    return samples, list(spec.channelnames)


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
