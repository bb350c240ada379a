"""An evaluation of the shading model in double precision that shares no code with the product.

scene.py reads a scene document, shapes.py casts rays, phong.py lights what they hit, color.py
converts the result. program.py runs `shade` and reads its pictures, so that tests can compare.
Every formula is the model's own, written plainly: speed and reuse are not aims here.
"""
