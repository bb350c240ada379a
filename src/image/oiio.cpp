/* The module shaded_oiio.so: OpenImageIO behind a few C functions. Here it is set up, and writes.
 * Nothing thrown leaves the module, and it needs nothing from the program that loads it. */
#include <OpenImageIO/filesystem.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "image/oiio.hpp"

namespace {

/* For the whole process, before any thread encodes: each encodes on its own, and a server's output
 * is not OpenImageIO's. */
void set_up() {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    OIIO::attribute("debug", 0);
    /* Lists the formats now, which takes a while: writers drop attributes named after other
     * formats, and where threads come first together one may see the list half made. */
    OIIO::get_string_attribute("format_list");
    OIIO::ImageOutput::create("memory.exr");
}

/* Collects the file in memory that free() ends, so that it need not be copied. Writers go back
 * to patch offsets. */
class Memory : public OIIO::Filesystem::IOProxy {
  public:
    Memory() : IOProxy("", Write) {}
    ~Memory() override { std::free(data); }
    Memory(const Memory &) = delete;
    Memory &operator=(const Memory &) = delete;

    const char *proxytype() const override { return "memory"; }
    size_t size() const override { return length; }

    size_t write(const void *from, size_t bytes) override {
        bytes = pwrite(from, bytes, m_pos);
        m_pos += static_cast<int64_t>(bytes);
        return bytes;
    }

    size_t pwrite(const void *from, size_t bytes, int64_t offset) override {
        if (offset < 0 || bytes > SIZE_MAX / 4 || static_cast<size_t>(offset) > SIZE_MAX / 4)
            return 0;
        size_t start = static_cast<size_t>(offset), end = start + bytes;
        if (end > room && !grow(end)) return 0;
        if (start > length) std::memset(data + length, 0, start - length);
        if (bytes) std::memcpy(data + start, from, bytes);
        if (end > length) length = end;
        return bytes;
    }

    unsigned char *release() {
        unsigned char *out = data;
        data = nullptr;
        return out;
    }

    /* OpenEXR leaves out the lines that it has no memory to compress, and says nothing; their
     * offsets in the table behind the header stay 0 (OpenEXR File Layout: magic, version,
     * attributes of a name, a type, a size and a value, an empty name, an offset of 8 bytes for
     * each chunk of lines). */
    bool lacks_chunks(int chunks) const {
        size_t at = 8;
        while (at < length && data[at]) {
            for (int text = 0; text < 2; text++) {
                while (at < length && data[at]) at++;
                at++;
            }
            if (length < 4 || at > length - 4) return true;
            uint32_t bytes;
            std::memcpy(&bytes, data + at, sizeof bytes);
            at += 4 + bytes;
        }
        at++;
        for (int i = 0; i < chunks; i++, at += 8) {
            static const unsigned char missing[8] = {};
            if (length < 8 || at > length - 8 || !std::memcmp(data + at, missing, 8)) return true;
        }
        return false;
    }

    bool starved = false;

  private:
    bool grow(size_t need) {
        size_t larger = room ? 2 * room : 1 << 16;
        if (larger < need) larger = need;
        void *moved = std::realloc(data, larger);
        starved = !moved;
        if (!moved) return false;
        data = static_cast<unsigned char *>(moved);
        room = larger;
        return true;
    }

    unsigned char *data = nullptr;
    size_t length = 0, room = 0;
};

/* What is compressed by one call of zlib, which cannot be left, has half a megabyte or so. */
const OIIO::imagesize_t most_at_once = 1 << 19;

/* What is compressed at once: a tile, or as many lines as OpenEXR's file layout gives each method.
 * None is named yet: as many as ZIP or, of long lines, ZIPS has. */
int lines_of_chunk(const OIIO::ImageSpec &spec) {
    static const struct {
        const char *name;
        int lines;
    } methods[] = {{"none", 1}, {"rle", 1},  {"zips", 1},  {"zip", 16},  {"pxr24", 16},
                   {"piz", 32}, {"b44", 32}, {"b44a", 32}, {"dwaa", 32}, {"dwab", 256}};
    if (spec.tile_height) return spec.tile_height;
    for (const auto &method : methods)
        if (spec.get_string_attribute("compression") == method.name) return method.lines;
    return spec.scanline_bytes(true) <= (1 << 16) ? 16 : 1;
}

int chunks_of(const OIIO::ImageSpec &spec) {
    const int lines = lines_of_chunk(spec), rows = (spec.height + lines - 1) / lines;
    return spec.tile_width ? rows * ((spec.width + spec.tile_width - 1) / spec.tile_width) : rows;
}

/* Longer lines are cut into tiles, whose sides are powers of 2. */
void cut_long_lines(OIIO::ImageSpec &spec) {
    if (spec.scanline_bytes(true) <= most_at_once) return;
    OIIO::imagesize_t side = 256;
    while (side > 16 && side * side * spec.pixel_bytes(true) > most_at_once) side /= 2;
    spec.tile_width = spec.tile_height = static_cast<int>(side);
    while (spec.tile_height > 16 && spec.tile_height / 2 >= spec.height) spec.tile_height /= 2;
}

OIIO::ImageSpec describe_file(const shd_oiio_job &job) {
    OIIO::ImageSpec spec(job.width, job.height, 0, stored_type(job.planes[0].depth));
    bool mixed = false;
    for (size_t p = 0; p < job.plane_count; p++) {
        const shd_oiio_plane &plane = job.planes[p];
        mixed = mixed || plane.depth != job.planes[0].depth;
        for (int c = 0; c < plane.count; c++) {
            spec.channelnames.push_back(plane.names[c]);
            spec.channelformats.push_back(stored_type(plane.depth));
            spec.nchannels++;
        }
    }
    if (!mixed) spec.channelformats.clear();
    spec.alpha_channel = job.alpha;

    /* TIFF's default level 6 takes four times level 3's time for a quarter fewer bytes. */
    const bool tiff = !std::strcmp(job.suffix, "tiff");
    if (std::strcmp(job.suffix, "hdr")) cut_long_lines(spec);
    spec.attribute("compression", job.compression            ? job.compression
                                  : tiff                     ? "zip:3"
                                  : lines_of_chunk(spec) > 1 ? "zip"
                                                             : "zips");
    if (tiff && job.planes[0].depth == SHD_HALF) spec.attribute("tiff:half", 1);
    if (job.icc_size)
        spec.attribute("ICCProfile",
                       OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(job.icc_size)),
                       job.icc);
    if (job.primaries)
        spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), job.primaries);
    if (job.space) spec.attribute("shaded:colorSpace", job.space);
    if (job.interop) spec.attribute("colorInteropID", job.interop);
    if (job.shown) spec.attribute("shaded:channels", job.shown);
    if (job.about) spec.attribute("ImageDescription", job.about);
    /* Writers add today's date where there is no DateTime, and drop one that is no text: equal
     * pictures stay equal bytes. */
    spec.attribute("DateTime", 0);
    return spec;
}

/* Asks whether to go on, and throws Stopped if not. */
void ask_to_go_on(const shd_oiio_job &job) {
    if (job.go_on && !job.go_on(job.context)) throw Stopped();
}

/* Pixels as the file stores them, all planes of a pixel side by side. */
const void *weave_planes(const shd_oiio_job &job, const OIIO::ImageSpec &spec) {
    if (job.plane_count == 1 && job.planes[0].depth != SHD_HALF) return job.planes[0].values;
    const size_t pixel = spec.pixel_bytes(true);
    size_t offset = 0;
    const int band = 1 + (1 << 16) / job.width;
    for (size_t p = 0; p < job.plane_count; p++) {
        const shd_oiio_plane &plane = job.planes[p];
        OIIO::TypeDesc to = stored_type(plane.depth);
        OIIO::TypeDesc from = plane.depth == SHD_HALF ? OIIO::TypeDesc::FLOAT : to;
        const auto from_row = static_cast<OIIO::stride_t>(from.size()) * plane.count * job.width;
        const auto to_pixel = static_cast<OIIO::stride_t>(pixel), to_row = to_pixel * job.width;
        for (int y = 0; y < job.height; y += band) {
            ask_to_go_on(job);
            OIIO::convert_image(plane.count, job.width, std::min(band, job.height - y), 1,
                                static_cast<const unsigned char *>(plane.values) + from_row * y,
                                from, from_row / job.width, from_row, OIIO::AutoStride,
                                static_cast<unsigned char *>(job.pixels) + offset + to_row * y, to,
                                to_pixel, to_row, OIIO::AutoStride);
        }
        offset += to.size() * static_cast<size_t>(plane.count);
    }
    return job.pixels;
}

/* In bands, between which it may be left: OpenImageIO's own are of 64 MB. The writers compress as
 * lines come, whichever come together, so that bytes are the same. */
bool write_bands(OIIO::ImageOutput &output, const shd_oiio_job &job, const void *pixels) {
    const OIIO::ImageSpec &spec = output.spec();
    const OIIO::imagesize_t line = spec.scanline_bytes(true), most = 1 << 18;
    const int rows = static_cast<int>(1 + most / line);
    for (int y = 0; y < job.height; y += rows) {
        ask_to_go_on(job);
        const int end = std::min(y + rows, job.height);
        const auto *band =
            static_cast<const unsigned char *>(pixels) + line * static_cast<OIIO::imagesize_t>(y);
        if (!output.write_scanlines(y, end, 0, OIIO::TypeDesc::UNKNOWN, band)) return false;
    }
    return true;
}

/* A tile, of what the picture has of it. OpenImageIO fills the rest of a TIFF's tile with what
 * memory happens to hold, so that gets zeros; and OpenEXR's, which has no rest, may have no gap
 * between its rows. */
bool write_tile(OIIO::ImageOutput &output, const unsigned char *pixels, int x, int y, bool tiff) {
    const OIIO::ImageSpec &spec = output.spec();
    const size_t pixel = spec.pixel_bytes(true), line = pixel * static_cast<size_t>(spec.width);
    const int right = std::min(x + spec.tile_width, spec.width),
              bottom = std::min(y + spec.tile_height, spec.height);
    const size_t some = static_cast<size_t>(right - x) * pixel,
                 row = tiff ? static_cast<size_t>(spec.tile_width) * pixel : some;
    std::vector<unsigned char> tile(row * static_cast<size_t>(spec.tile_height));
    const unsigned char *from =
        pixels + static_cast<size_t>(y) * line + static_cast<size_t>(x) * pixel;
    unsigned char *to = tile.data();
    for (int i = y; i < bottom; i++, from += line, to += row) std::memcpy(to, from, some);
    return tiff ? output.write_tile(x, y, 0, spec.format, tile.data())
                : output.write_tiles(x, right, y, bottom, 0, 1, OIIO::TypeDesc::UNKNOWN,
                                     tile.data());
}

/* In tiles, between which it may be left, too. */
bool write_tiles(OIIO::ImageOutput &output, const shd_oiio_job &job, const void *pixels) {
    const OIIO::ImageSpec &spec = output.spec();
    const bool tiff = !std::strcmp(job.suffix, "tiff");
    for (int y = 0; y < spec.height; y += spec.tile_height) {
        for (int x = 0; x < spec.width; x += spec.tile_width) {
            ask_to_go_on(job);
            if (!write_tile(output, static_cast<const unsigned char *>(pixels), x, y, tiff))
                return false;
        }
    }
    return true;
}

int encode_picture(const shd_oiio_job &job, unsigned char **data, size_t *size) {
    Memory memory;
    std::string name = std::string("memory.") + job.suffix;
    auto output = OIIO::ImageOutput::create(name, &memory);
    if (!output) throw std::runtime_error(OIIO::geterror());
    if (!output->supports("ioproxy"))
        throw std::runtime_error(std::string("no writing to memory for ") + job.suffix);

    OIIO::ImageSpec spec = describe_file(job);
    const void *pixels = weave_planes(job, spec);
    bool written = output->set_ioproxy(&memory) && output->open(name, spec) &&
                   (spec.tile_width ? write_tiles : write_bands)(*output, job, pixels);
    written = output->close() && written;
    if (memory.starved) return 1;
    if (!written || !memory.size()) throw std::runtime_error(output->geterror());
    if (!std::strcmp(job.suffix, "exr") && memory.lacks_chunks(chunks_of(spec))) return 1;
    *size = memory.size();
    *data = memory.release();
    return 0;
}

} // namespace

static int encode_job(const shd_oiio_job *job, unsigned char **data, size_t *size, char *text,
                      size_t text_size) {
    return shielded(job->abi == sizeof *job, text, text_size,
                    [&] { return encode_picture(*job, data, size); });
}

extern "C" __attribute__((visibility("default"))) shd_oiio_encode_fn *shd_oiio_open(void) {
    try {
        set_up();
    } catch (...) {
        return nullptr;
    }
    return encode_job;
}
