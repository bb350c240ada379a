"""Scenes for reference_test.py: one a feature, by hand, and random ones by seed."""

import math
import random

SIZE = {"width": 96, "height": 72, "samples": 1}
KEY = {"type": "directional", "direction": [-1, -1.5, -2]}
LAMP = {"type": "point", "position": [3, 4, 5], "intensity": 0.9}
SHINY = {"diffuse": [0.5, 0.3, 0.2], "specular": [0.4, 0.4, 0.5], "shininess": 40}


def scene(*objects, lights=(KEY, LAMP), **rest):
    return {"image": dict(SIZE), "camera": {"position": [0.3, 1.2, 5]}, "lights": list(lights),
            "objects": list(objects), **rest}


def grid(steps, height):
    """Positions, unit normals and indices of the graph of height(x, z) over [-1,1]^2."""
    positions, normals, indices = [], [], []
    at = [-1 + 2 * i / steps for i in range(steps + 1)]
    for z in at:
        for x in at:
            e = 1e-5
            n = [(height(x - e, z) - height(x + e, z)) / (2 * e), 1,
                 (height(x, z - e) - height(x, z + e)) / (2 * e)]
            size = math.sqrt(sum(c * c for c in n))
            positions += [x, height(x, z), z]
            normals += [c / size for c in n]
    for j in range(steps):
        for i in range(steps):
            a = j * (steps + 1) + i
            b = a + steps + 1
            indices += [a, b, b + 1, a, b + 1, a + 1]
    return positions, normals, indices


def hills(steps=9, smooth=True, **more):
    positions, normals, indices = grid(steps, lambda x, z: 0.3 * math.sin(3 * x) * math.cos(2 * z))
    return {"type": "mesh", "positions": positions, "indices": indices,
            "normals": normals if smooth else None, "material": SHINY,
            "transform": {"rotate": [50, 25, 0], "scale": 1.3}, **more}


def coarse_ball(steps, **more):
    """A coarse sphere with its own normals, which near silhouettes face away from the viewer."""
    positions, indices = [], []
    for k in range(steps + 1):
        for i in range(2 * steps):
            ring, turn = math.sin(math.pi * k / steps), math.pi * i / steps
            positions += [ring * math.cos(turn), math.cos(math.pi * k / steps),
                          ring * math.sin(turn)]
            a, b = 2 * steps * k + i, 2 * steps * k + (i + 1) % (2 * steps)
            if 0 < k < steps:
                indices += [a, b, b + 2 * steps]
            if k < steps - 1:
                indices += [a, b + 2 * steps, a + 2 * steps]
    return {"type": "mesh", "positions": positions, "normals": positions, "indices": indices,
            "material": SHINY, **more}


def row(material_of, values, **more):
    n = len(values)
    return [{"type": "sphere", "radius": 2.1 / n, "material": material_of(v),
             "transform": {"translate": [(i - (n - 1) / 2) * 4.6 / n, 0, 0]}, **more}
            for i, v in enumerate(values)]


TURNED = {"rotate": [25, -35, 15], "scale": [1.3, 0.8, 1.1], "translate": [0.2, 0.1, -0.3]}
SHAPES = {
    "sphere": {"radius": 1.1},
    "plane": {},
    "disc": {"radius": 1.4},
    "box": {"size": [1.8, 1.1, 1.4]},
    "cylinder": {"radius": 0.8, "height": 1.7},
    "cone": {"radius": 1, "height": 2.1},
    "torus": {"radius": 0.9, "tube": 0.35},
}


def shape(name, transform, material=None, **more):
    return {"type": name, **SHAPES[name], "transform": transform, "material": material or SHINY,
            **more}


def turned(rotate, v):
    """About x, then y, then z."""
    for axis, degrees in enumerate(rotate):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        v = list(v)
        v[a], v[b] = c * v[a] - s * v[b], s * v[a] + c * v[b]
    return v


def lights_in_planes():
    """Lights in the plane of a tilted face, to within rounding: a point, a spot, a directional."""
    glossy = {"diffuse": 0.3, "specular": 0.7, "shininess": 3}
    quad = {"type": "mesh", "positions": [-1.5, 0, -1.2, 1.5, 0, -1.2, 1.5, 0, 1.2, -1.5, 0, 1.2],
            "indices": [0, 2, 1, 0, 3, 2]}
    faces = [("plane", {"type": "plane"}, 0), ("disc", {"type": "disc", "radius": 1.6}, 0),
             ("quad", quad, 0), ("box", {"type": "box", "size": [1.8, 1.1, 1.5]}, 0.55),
             ("cylinder", {"type": "cylinder", "height": 1.2}, 0.6),
             ("cone", {"type": "cone", "height": 1.4}, -0.7)]
    for number, (name, item, height) in enumerate(faces):
        for k, rotate in enumerate(([31, 17, 23 + number], [-143, 29, 11], [57, -71, 5])):
            move = [0.1 * k, -0.3, 0.2]
            at = [turned(rotate, v) for v in ([0.7, height, 2.6], [-2.9, height, 0.4])]
            at = [[a + b for a, b in zip(v, move)] for v in at]
            aim = turned(rotate, [1, 0, 0.05])
            placed = {**item, "transform": {"rotate": rotate, "translate": move}}
            lights = [{"type": "point", "position": at[0], "attenuation": [0.2, 0, 0.3]},
                      {"type": "spot", "position": at[1], "direction": aim, "angle": 60,
                       "penumbra": 0.7},
                      {"type": "directional", "direction": turned(rotate, [0.3, 0, -1])},
                      {**LAMP, "intensity": 0.1}]
            yield f"light_in_plane_of_{name}_{k}", scene({**placed, "material": glossy},
                                                         lights=lights)
            # Beyond what vectors hold: one point and one light at a time.
            huge = [{**light, "intensity": 1e31 * light.get("intensity", 1)} for light in lights]
            dull = {"diffuse": 3e-32, "specular": 7e-32, "shininess": 3}
            yield f"huge_light_in_plane_of_{name}_{k}", scene(
                {**placed, "material": dull},
                lights=huge)


def beyond_vectors():
    """Lights that kernels leave to the reference."""
    # In the plane of one of two parallel faces; the other one is lit.
    yield "huge_light_above_a_parallel_face", scene(
        {"type": "disc", "transform": {"translate": [1, 0.5, 0]}, "material": {"diffuse": 3e-32}},
        {"type": "plane", "transform": {"translate": [0, -0.7, 0]}, "material": {"diffuse": 3e-32}},
        lights=[{"type": "point", "position": [-1, 0.5, 1], "intensity": 1e31}])
    yield "least_distance_without_a_square", {
        "image": dict(SIZE), "camera": {"position": [0, 0.001, 0.005]}, "ambient": 0.1,
        "objects": [{"type": "sphere", "radius": 0.001}],
        "lights": [{"type": "point", "position": [0.003, 0.002, 0.005], "attenuation": [0, 0, 1],
                    "minDistance": 1e152, "intensity": 1e304}]}


def by_hand():
    yield from lights_in_planes()
    yield "smallest", {"image": dict(SIZE), "objects": [{"type": "sphere"}]}
    yield "emissive", scene({"type": "sphere", "material": {
        "emissive": [0.9, 0.4, 0.1], "diffuse": 0}}, lights=[])
    yield "ambient", scene({"type": "sphere", "material": {"ambient": [0.2, 0.5, 0.9]}},
                           lights=[], ambient=[0.5, 0.25, 1])
    yield "ambient_shares", scene(
        {"type": "sphere", "material": {"ambient": [0.2, 0.5, 0.9], "diffuse": 0.4}},
        ambient=0.1, lights=[{"type": "ambient", "color": [0.3, 0.2, 0.1], "intensity": 2},
                             {**LAMP, "ambient": [0.05, 0.1, 0.15], "attenuation": [0, 0, 1]}])
    yield "ambient_follows_diffuse", scene(
        {"type": "sphere", "material": {"diffuse": [0.2, 0.5, 0.9]}}, ambient=0.5)
    yield "diffuse", scene({"type": "sphere", "material": {"diffuse": "#cc8844"}})
    yield "attenuation", scene(
        *row(lambda _: SHINY, [0, 1, 2]), lights=[
            {"type": "point", "position": [-2, 1, 1], "attenuation": [0.1, 0.5, 0]},
            {"type": "point", "position": [2, -1, 1.5], "attenuation": [0, 0, 1]},
            {"type": "point", "position": [0, 2, 2], "attenuation": [1, 0.2, 0.3]}])
    yield "minimum_distance", scene({"type": "plane", "material": SHINY}, lights=[
        {"type": "point", "position": [0, 0.2, 1], "attenuation": [0, 0, 1], "minDistance": 1.5}])
    floor = {"type": "plane", "transform": {"translate": [0, -1, 0]},
             "material": {"diffuse": 0.7, "specular": 0.5, "shininess": 20}}
    ball = {"type": "sphere", "radius": 0.7, "material": SHINY}
    yield "spot", scene(floor, ball, lights=[
        {"type": "spot", "position": [1, 4, 1], "direction": [-1, -4, -1], "angle": 25}])
    yield "spot_hard_edge", scene(floor, ball, lights=[
        {"type": "spot", "position": [1, 4, 1], "direction": [-1, -4, -1], "angle": 20,
         "penumbra": 0, "exponent": 3}])
    yield "spot_all_penumbra", scene(floor, ball, lights=[
        {"type": "spot", "position": [-2, 3, 2], "direction": [2, -3, -2], "angle": 40,
         "penumbra": 1, "exponent": 12.5, "attenuation": [0, 0, 0.1]}])
    yield "spot_narrow", scene(floor, ball, lights=[
        {"type": "spot", "position": [20, 40, 10], "direction": [-20, -41, -9], "angle": 1,
         "penumbra": 0.5}])
    yield "spot_wide", scene(floor, ball, lights=[
        {"type": "spot", "position": [0, 0.5, 1.5], "direction": [0, 1, -0.3], "angle": 130,
         "penumbra": 0.4}])
    yield "spot_of_half_a_turn", scene(floor, ball, lights=[
        {"type": "spot", "position": [0, 0.5, 1.5], "direction": [0, 1, 0], "angle": 180}])
    yield "homogeneous", scene(ball, floor, lights=[
        {"position": [1, 2, 3, 0], "color": "#ffd0a0"},
        {"position": [-6, 4, 6, 2], "intensity": 0.5, "attenuation": [0, 1, 0]},
        {"position": [1, -4, -6, -2], "color": [0, 0.3, 0.5]}])
    yield "camera_frame", scene(
        ball, floor, camera={"position": [3, 2, 3], "target": [0, -0.2, 0], "up": [0.2, 1, 0]},
        lights=[{"type": "directional", "direction": [1, -0.5, -1], "frame": "camera",
                 "color": [0.5, 0, 0]},
                {"type": "point", "position": [1, 1, 0], "frame": "camera", "intensity": 0.4},
                {"type": "spot", "position": [-0.5, 0.2, 0], "direction": [0.1, 0, -1],
                 "angle": 15, "frame": "camera", "color": [0, 0.5, 1]},
                {"position": [0, 1, 0, 0], "frame": "camera", "color": [0, 0.2, 0]}])
    yield "shininess", scene(*row(lambda ns: {"diffuse": 0.2, "specular": 0.8, "shininess": ns},
                                  [0, 0.5, 1, 10, 120, 1000]))
    yield "shininess_extreme", scene(*row(
        lambda ns: {"diffuse": 0.2, "specular": 0.8, "shininess": ns}, [3e3, 1e4, 1e5, 1e6]))
    yield "lobes", scene({"type": "sphere", "radius": 1.3, "material": {
        "diffuse": [0.1, 0.2, 0.3], "specular": [0.3, 0, 0], "shininess": 400,
        "lobes": [{"specular": [0, 0.3, 0.1], "shininess": 20},
                  {"specular": 0.1, "shininess": 3}]}})
    yield "intensity_above_one", scene({"type": "sphere", "material": SHINY}, lights=[
        {**KEY, "intensity": 1000}, {**LAMP, "color": [-0.5, 0.2, 0.1]}])
    for name in SHAPES:
        floorless = name == "plane"
        yield f"shape_{name}", scene(
            shape(name, TURNED if not floorless else {"rotate": [20, 0, 10],
                                                      "translate": [0, -0.5, 0]}))
    for name in SHAPES:
        if name != "plane":
            yield f"mirrored_{name}", scene(
                shape(name, {"matrix": [-1.2, 0.3, 0, 0, 0.2, 0.9, -0.4, 0,
                                        0.1, 0.5, 0.7, 0, 0.1, -0.2, 0.3, 1]},
                      {**SHINY, "side": "front"}))
    yield "flattened", scene({"type": "sphere", "transform": {
        "scale": [1.5, 1.5, 0.05], "rotate": [0, 50, 0]}, "material": SHINY})
    yield "inside_a_sphere", scene({"type": "sphere", "radius": 9, "material": SHINY})
    yield "inside_seen_from_front_only", scene(
        {"type": "box", "size": [11, 11, 13], "material": {**SHINY, "side": "front"}},
        {"type": "cylinder", "material": {**SHINY, "side": "front"},
         "transform": {"translate": [0, 0, 5]}})
    yield "disc_from_behind", scene(
        shape("disc", {"rotate": [-60, 0, 0], "translate": [-1.45, 0, 0]}, {**SHINY, "side": "front"}),
        shape("disc", {"rotate": [-60, 0, 0], "translate": [1.45, 0, 0]}, {**SHINY, "side": "both"}),
        lights=[KEY, LAMP, {"type": "point", "position": [0, -3, -2]}])
    for interpolation in ("phong", "gouraud", "flat"):
        yield f"mesh_{interpolation}", scene(hills(), interpolation=interpolation)
    behind = [{"type": "directional", "direction": [-4, -1, 3]},
              {"type": "point", "position": [1, 3, -4]}]
    for interpolation in ("phong", "gouraud"):
        for side in ("both", "front"):
            yield f"mesh_lit_from_behind_{interpolation}_{side}", scene(
                coarse_ball(5, interpolation=interpolation, material={**SHINY, "side": side}),
                lights=behind)
        yield f"mesh_open_{interpolation}", scene(
            hills(4, transform={"rotate": [8, 25, 0], "scale": 1.3}, interpolation=interpolation),
            lights=[KEY, LAMP, {"type": "point", "position": [0, -3, 1]}])
    yield "mesh_of_facets", scene(hills(smooth=False))
    yield "mesh_of_facets_gouraud", scene(hills(5, smooth=False, interpolation="gouraud"))
    yield "box_flat", scene(shape("box", TURNED), interpolation="flat", lights=[
        KEY, {**LAMP, "attenuation": [0, 0, 0.05]}])
    skewed = {"matrix": [1.5, 0.2, 0, 0, 0.3, -0.6, 0.9, 0, 0, 1.1, 0.7, 0, 0, 0.2, 0.1, 1]}
    for interpolation in ("phong", "gouraud", "flat"):
        yield f"mesh_mirrored_{interpolation}", scene(
            hills(4, transform=skewed, material={**SHINY, "side": "front"}),
            interpolation=interpolation)
    yield "orthographic", scene(
        shape("torus", TURNED), floor, lights=[KEY, LAMP], camera={
            "type": "orthographic", "position": [2, 3, 4], "height": 4})
    yield "rolled_camera", scene(shape("box", TURNED), floor, camera={
        "position": [3, 1, 2], "target": [0.2, 0.1, -0.3], "up": [1, 0.4, 0], "fov": 35})
    yield "wide_camera", scene(*row(lambda _: SHINY, [1, 2, 3]), floor, camera={
        "position": [0, 0.5, 1.6], "fov": 120})
    yield "telephoto", scene(shape("cone", TURNED), camera={
        "position": [3e4, 2e4, 4e4], "target": [0.2, 0.1, -0.3], "fov": 0.003})
    yield "colors", scene(
        *row(lambda c: {"diffuse": c, "ambient": c},
             ["#f80", "#336699", 0.25, [0.1, 0.6, 0.3],
              {"space": "lin_rec709", "value": [0.5, 0.1, 0.1]},
              {"space": "sRGB", "value": [0.5, 0.1, 0.9]}]),
        ambient="#222", background="#123456",
        lights=[{**KEY, "color": "#ffeedd"}, {**LAMP, "color": 0.5}])
    yield "dark_hexadecimal_colors", scene(
        *row(lambda c: {"diffuse": 0, "emissive": c}, ["#010203", "#080706", "#0a0a09", "#000"]),
        lights=[])
    yield "colors_of_another_space", scene(
        *row(lambda c: {"diffuse": c}, [0.5, [0.1, 0.6, 0.3], "#808080"]), colorSpace="sRGB")
    yield "transparent", scene(shape("cone", TURNED), background=None)
    yield "sixty_lights", scene(ball, floor, lights=[
        {"type": "point", "position": [6 * math.cos(i), 3 + 2 * math.sin(2.7 * i), 6 * math.sin(i)],
         "color": [0.02 + 0.01 * (i % 3), 0.03, 0.02 + 0.01 * (i % 2)]} for i in range(60)])
    for name, size in (("huge", 1e12), ("tiny", 1e-12)):
        big = scene({"type": "sphere", "radius": size, "material": SHINY},
                    {"type": "box", "size": [size, 3 * size, size], "material": SHINY,
                     "transform": {"translate": [1.2 * size, 0, 0]}},
                    lights=[KEY, {"type": "point", "position": [3 * size, 4 * size, 5 * size],
                                  "attenuation": [0, 0, size ** -2]}])
        big["camera"] = {"position": [0.3 * size, 1.2 * size, 5 * size]}
        yield name, big
    for samples in (2, 4, 5, 16):
        several = scene(ball, floor, hills(3), background=None if samples == 5 else "#406080")
        several["image"] = {"width": 48, "height": 36, "samples": samples}
        yield f"samples_{samples}", several


def further_models():
    """Each model beside Phong's, on what bends, is flat, or has normals of its own."""
    body = {"diffuse": [0.5, 0.3, 0.2], "ambient": 0}
    shiny = {"specular": [0.4, 0.5, 0.3], "lobes": [{"specular": 0.2, "shininess": 300.5}]}
    rough = {"lobes": [{"roughness": 0.15, "weight": 0.4}, {"roughness": 0.5, "weight": 0.6}]}
    spot = {"type": "spot", "position": [-3, 4, 3], "direction": [0.7, -1, -0.8], "angle": 35,
            "attenuation": [0.2, 0, 0.05]}
    materials = {
        "blinn": {"model": "blinn-phong", **body, **shiny, "shininess": 20},
        "blinn_wide": {"model": "blinn-phong", **body, "specular": 0.5, "shininess": 0},
        "normalized": {"model": "phong-normalized", **body, **shiny, "shininess": 12.3},
        "normalized_wide": {"model": "phong-normalized", **body, "specular": 0.5, "shininess": 0},
        "normalized_sharp": {"model": "phong-normalized", "diffuse": 0, "specular": 0.001,
                             "shininess": 5000},
        "oren_nayar": {"model": "oren-nayar", **body, "sigma": 30},
        "oren_nayar_smooth": {"model": "oren-nayar", **body},
        "oren_nayar_rough": {"model": "oren-nayar", **body, "sigma": 90},
        "cook_torrance": {"model": "cook-torrance", **body, **rough},
        "cook_torrance_gold": {"model": "cook-torrance", "diffuse": 0, "fresnel": {"n": "gold"}},
        "cook_torrance_f0": {"model": "cook-torrance", **body, "fresnel": {"f0": [0.9, 0.04, 0.3]},
                             "lobes": [{"roughness": 1}]},
        "cook_torrance_index": {"model": "cook-torrance", **body, **rough, "side": "front",
                                "fresnel": {"n": [1.2, 1.5, 2.4], "k": [0, 0.5, 3]}},
    }
    for name, material in materials.items():
        yield f"model_{name}", scene(
            {"type": "sphere", "material": material, "transform": {"translate": [-1.3, 0.3, 0]}},
            {"type": "torus", "radius": 0.8, "tube": 0.3, "material": material,
             "transform": {"translate": [1.2, 0.4, -0.5], "rotate": [60, 0, 20]}},
            {"type": "plane", "material": material, "transform": {"translate": [0, -1, 0]}},
            coarse_ball(5, transform={"translate": [0, -0.4, 1.2], "scale": 0.5}) |
            {"material": material},
            lights=(KEY, LAMP, spot))


def by_seed(seed):
    """A scene that mixes everything."""
    r = random.Random(seed)

    def color(most=1.0):
        choice = r.random()
        if choice < 0.2:
            return r.uniform(0, most)
        if choice < 0.4:
            return f"#{r.randrange(0x1000000):06x}"
        return [r.uniform(0, most) for _ in range(3)]

    def place(reach):
        return [r.uniform(-reach, reach) for _ in range(3)]

    def light():
        kind = r.choice(["directional", "point", "point", "spot", "ambient", "homogeneous"])
        more = {"color": color(), "intensity": r.uniform(0.2, 1.2)}
        if r.random() < 0.3:
            more["frame"] = "camera"
        if r.random() < 0.2:
            more["ambient"] = color(0.1)
        if kind == "ambient":
            return {"type": kind, "color": color(0.2)}
        if kind == "directional":
            return {"type": kind, "direction": place(1), **more}
        if kind == "homogeneous":
            return {"position": place(4) + [r.choice([0, 1, -0.5])], **more}
        more["position"] = place(5)
        more["attenuation"] = r.choice([[1, 0, 0], [0.3, 0.2, 0], [0.2, 0, 0.1], [0.1, 0.1, 0.05]])
        if kind == "spot":
            more.update(direction=[-c + r.uniform(-1, 1) for c in more["position"]],
                        angle=r.uniform(5, 90), penumbra=r.choice([0, 0.2, 1]),
                        exponent=r.choice([0, 0, 2, 20]))
        return {"type": kind, **more}

    def material():
        m = {"diffuse": color(0.8), "specular": color(0.6),
             "shininess": r.choice([0, 1, 5.5, 27.9, 90, 300, 1000])}
        if r.random() < 0.3:
            m["ambient"] = color()
        if r.random() < 0.2:
            m["emissive"] = color(0.2)
        if r.random() < 0.2:
            m["lobes"] = [{"specular": color(0.3), "shininess": r.uniform(1, 500)}]
        if r.random() < 0.2:
            m["side"] = "front"
        return m

    def transform():
        scale = [r.choice([-1, 1, 1]) * r.uniform(0.4, 1.2) for _ in range(3)]
        return {"scale": scale if r.random() < 0.6 else abs(scale[0]),
                "rotate": [r.uniform(-180, 180) for _ in range(3)], "translate": place(1.3)}

    objects = []
    for _ in range(r.randint(2, 7)):
        name = r.choice(list(SHAPES) + ["mesh"])
        if name == "mesh":
            objects.append({**hills(r.randint(2, 6), smooth=r.random() < 0.6),
                            "interpolation": r.choice(["phong", "gouraud", "flat"]),
                            "material": material(), "transform": transform()})
        elif name == "box" and r.random() < 0.4:
            objects.append(shape(name, transform(), material(), interpolation="flat"))
        elif name == "plane":
            objects.append({"type": "plane", "material": material(), "transform": {
                "rotate": [r.uniform(-30, 30), 0, r.uniform(-30, 30)],
                "translate": [0, r.uniform(-2.5, -1), 0]}})
        else:
            objects.append(shape(name, transform(), material()))
    camera = {"position": [r.uniform(-2, 2), r.uniform(-0.5, 3), r.uniform(4, 6)],
              "target": place(0.4), "up": [r.uniform(-0.5, 0.5), 1, r.uniform(-0.5, 0.5)],
              "fov": r.uniform(25, 70)}
    if r.random() < 0.3:
        camera = {**camera, "type": "orthographic", "height": r.uniform(3, 6)}
        del camera["fov"]
        camera["position"] = [20 * c for c in camera["position"]]
    document = {"image": dict(SIZE), "camera": camera, "objects": objects, "ambient": color(0.2),
                "background": None if r.random() < 0.2 else color(0.3)}
    if r.random() < 0.9:
        document["lights"] = [light() for _ in range(r.randint(0, 5))]
    return document
