"""An evaluation of the shading model in double precision that shares no code with the product.

scene.py reads a scene document, shapes.py casts rays, phong.py lights what they hit, color.py
converts the result. program.py runs `shade` and reads its pictures, so that tests can compare.
Every formula is the model's own, written plainly: speed and reuse are not aims here.
"""
import ctypes

# Arrays of megabytes come and go by the thousand here: their memory stays with the process, instead of being
# mapped and zeroed anew for each (mallopt(3): M_MMAP_THRESHOLD, M_TRIM_THRESHOLD).
_libc = ctypes.CDLL(None)
_libc.mallopt(-3, 1 << 25)
_libc.mallopt(-1, (1 << 31) - 1)
