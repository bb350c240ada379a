/* Two pictures as floats, and how far apart they are at each pixel. */

const TYPES = { 3: ["getUint16", 2], 4: ["getUint32", 4] };

/* The members of a TIFF's first directory that are numbers: tag -> list. */
function readTags(view) {
    const tags = new Map(), at = view.getUint32(4, true);
    if (view.getUint16(0) !== 0x4949) throw new Error("this is no TIFF as the daemon writes them");
    for (let i = 0; i < view.getUint16(at, true); i++) {
        const entry = at + 2 + 12 * i, [read, size] = TYPES[view.getUint16(entry + 2, true)] ?? [];
        if (!read) continue;
        const count = view.getUint32(entry + 4, true), from = count * size > 4 ? view.getUint32(entry + 8, true) : entry + 8;
        tags.set(view.getUint16(entry, true), Array.from({ length: count }, (_, k) => view[read](from + size * k, true)));
    }
    return tags;
}

async function inflate(bytes) {
    const answer = new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
    return new Uint8Array(await answer.arrayBuffer());
}

/* Floats of a row as the predictor for floats leaves them (Adobe's Technical Note 3): differences of
 * bytes, those of all exponents first. */
function restore(row, samples, count, out) {
    for (let i = samples; i < row.length; i++) row[i] += row[i - samples];
    for (let i = 0; i < count; i++)
        for (let k = 0; k < 4; k++) out.setUint8(4 * i + k, row[k * count + i]);
}

/* A TIFF of floats, of strips deflated with that predictor, as this daemon writes it: {width, height,
 * samples, values}: `samples` for each pixel, red, green and blue first. */
export async function readTiff(buffer) {
    const tags = readTags(new DataView(buffer)), one = (tag, usual) => tags.get(tag)?.[0] ?? usual;
    const width = one(256), height = one(257), samples = one(277, 1), rows = one(278, height), count = width * samples;
    if (one(258) !== 32 || one(339) !== 3 || one(259) !== 8 || one(317, 1) !== 3) throw new Error("this TIFF is written another way");
    const values = new Float32Array(height * count), out = new DataView(new ArrayBuffer(4 * count));
    const offsets = tags.get(273), sizes = tags.get(279);
    for (let strip = 0; strip < offsets.length; strip++) {
        const bytes = await inflate(new Uint8Array(buffer, offsets[strip], sizes[strip]));
        for (let y = strip * rows, k = 0; y < Math.min(height, (strip + 1) * rows); y++, k += 4 * count) {
            restore(bytes.subarray(k, k + 4 * count), samples, count, out);
            for (let i = 0; i < count; i++) values[y * count + i] = out.getFloat32(4 * i);
        }
    }
    return { width, height, samples, values };
}

/* ---- Lab of linear Rec.709, and CIEDE2000 (Sharma, Wu, Dalal 2005, equations 2 to 22) ---- */

const M = [[0.4123907993, 0.3575843394, 0.1804807884], [0.2126390059, 0.7151686788, 0.0721923154], [0.0193308187, 0.1191947798, 0.9505321522]];
const WHITE = M.map(row => row[0] + row[1] + row[2]);
const bent = t => t > 216 / 24389 ? Math.cbrt(t) : (24389 / 27 * t + 16) / 116;

export function labOf(r, g, b) {
    const [x, y, z] = M.map((row, i) => bent((row[0] * r + row[1] * g + row[2] * b) / WHITE[i]));
    return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

const RADIAN = Math.PI / 180;
const hueOf = (a, b) => a === 0 && b === 0 ? 0 : (Math.atan2(b, a) / RADIAN + 360) % 360;
const cos = degrees => Math.cos(degrees * RADIAN);
const seventh = c => Math.sqrt(c ** 7 / (c ** 7 + 25 ** 7));

export function deltaE2000([l1, a1, b1], [l2, a2, b2]) {
    const g = 0.5 * (1 - seventh((Math.hypot(a1, b1) + Math.hypot(a2, b2)) / 2));
    const [p1, p2] = [a1 * (1 + g), a2 * (1 + g)], c1 = Math.hypot(p1, b1), c2 = Math.hypot(p2, b2);
    const h1 = hueOf(p1, b1), h2 = hueOf(p2, b2), isGrey = c1 * c2 === 0;
    let dh = isGrey ? 0 : h2 - h1;
    if (dh > 180) dh -= 360;
    else if (dh < -180) dh += 360;
    const dL = l2 - l1, dC = c2 - c1, dH = 2 * Math.sqrt(c1 * c2) * Math.sin(dh / 2 * RADIAN);
    const l = (l1 + l2) / 2, c = (c1 + c2) / 2;
    let h = h1 + h2;
    if (!isGrey) h = Math.abs(h1 - h2) <= 180 ? h / 2 : h < 360 ? (h + 360) / 2 : (h - 360) / 2;
    const t = 1 - 0.17 * cos(h - 30) + 0.24 * cos(2 * h) + 0.32 * cos(3 * h + 6) - 0.2 * cos(4 * h - 63);
    const sL = 1 + 0.015 * (l - 50) ** 2 / Math.sqrt(20 + (l - 50) ** 2), sC = 1 + 0.045 * c, sH = 1 + 0.015 * c * t;
    const rT = -2 * seventh(c) * Math.sin(60 * Math.exp(-(((h - 275) / 25) ** 2)) * RADIAN);
    return Math.sqrt(Math.max(0, (dL / sL) ** 2 + (dC / sC) ** 2 + (dH / sH) ** 2 + rT * (dC / sC) * (dH / sH)));
}

/* ---- Errors ---- */

/* Linear light of codes, on both sides of zero. */
const mirrored = curve => code => code < 0 ? -curve(-code) : curve(code);
export const CURVES = {
    lin_rec709: code => code,
    sRGB: mirrored(code => code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4),
    "Rec.1886": mirrored(code => code ** 2.4),
};

/* What 99 % of values do not exceed, as /v1/compare counts. */
const p99Of = values => Float64Array.from(values).sort()[values.length - Math.floor(values.length / 100) - 1];

function summed(values, { width, height }, parts = values) {
    let most = 0;
    for (let i = 0; i < values.length; i++) if (values[i] > values[most]) most = i;
    return { width, height, values, max: values[most], at: [most % width, Math.floor(most / width)], p99: p99Of(parts) };
}

/* Of two pictures of the same size: {width, height, values: one a pixel, max, at: [x, y] of the
 * largest, p99}. Linear: the largest component's; p99 is of all components. */
export function linearErrors(one, other) {
    const { width, height, samples } = one, values = new Float64Array(width * height), parts = new Float64Array(3 * width * height);
    for (let i = 0; i < values.length; i++)
        for (let c = 0; c < 3; c++) {
            const apart = parts[3 * i + c] = Math.abs(one.values[samples * i + c] - other.values[samples * i + c]);
            values[i] = Math.max(values[i], apart);
        }
    return summed(values, one, parts);
}

/* CIEDE2000 of pictures with the primaries of Rec.709, `curve` away from linear light. */
export function seenErrors(one, other, curve) {
    const { width, height, samples } = one, values = new Float64Array(width * height);
    const lab = (picture, i) => labOf(...[0, 1, 2].map(c => curve(picture.values[samples * i + c])));
    for (let i = 0; i < values.length; i++) {
        const isSame = [0, 1, 2].every(c => one.values[samples * i + c] === other.values[samples * i + c]);
        if (!isSame) values[i] = deltaE2000(lab(one, i), lab(other, i));
    }
    return summed(values, one);
}
