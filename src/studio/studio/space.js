/* Vectors, and the frame of a camera. */

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const times = (a, s) => a.map(x => x * s);
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
export const length = a => Math.hypot(...a);
export const unit = a => times(a, 1 / (length(a) || 1));
export const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

export const CAMERA = { position: [0, 0, 4], target: [0, 0, 0], up: [0, 1, 0] };

/* Right, up and toward the viewer. */
export function frameOf(camera) {
    const { position, target, up } = { ...CAMERA, ...camera };
    const back = unit(sub(position, target));
    let right = cross(up, back);
    if (length(right) < 1e-6) right = cross([0, 0, -1], back);
    right = unit(right);
    return [right, cross(back, right), back];
}

export const toFrame = (frame, vector) => frame.map(axis => dot(axis, vector));
export const fromFrame = (frame, [x, y, z]) => add(add(times(frame[0], x), times(frame[1], y)), times(frame[2], z));

/* Turned about an axis (Rodrigues). */
export function turned(vector, axis, radians) {
    const c = Math.cos(radians), s = Math.sin(radians);
    return add(add(times(vector, c), times(cross(axis, vector), s)), times(axis, dot(axis, vector) * (1 - c)));
}

/* The camera after a drag: about `up` by `yaw`, and over the top by `pitch`, which stops before the
 * poles. */
export function orbited(camera, yaw, pitch) {
    const { position, target, up } = { ...CAMERA, ...camera };
    const axis = unit(up);
    let arm = turned(sub(position, target), axis, yaw);
    const height = Math.acos(Math.max(-1, Math.min(1, dot(unit(arm), axis))));
    const least = 0.05, next = Math.min(Math.PI - least, Math.max(least, height + pitch));
    const right = unit(cross(axis, arm));
    arm = turned(arm, right, next - height);
    return { ...camera, position: add(target, arm).map(x => Number(x.toFixed(4))) };
}

export function zoomed(camera, factor) {
    if (camera?.type === "orthographic") {
        const height = (camera.height ?? 2) * factor;
        return { ...camera, height: Number(Math.min(1e4, Math.max(1e-3, height)).toPrecision(4)) };
    }
    const { position, target } = { ...CAMERA, ...camera };
    const arm = sub(position, target), far = Math.min(1e4, Math.max(1e-2, length(arm) * factor));
    return { ...camera, position: add(target, times(unit(arm), far)).map(x => Number(x.toFixed(4))) };
}
