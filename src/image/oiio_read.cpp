/* What the module shaded_oiio.so reads: pictures of a file, and of bytes. */
#include <OpenImageIO/filesystem.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "image/oiio.hpp"

namespace {

/* The channels of the picture itself: a file may have layers beside it. Returns how many. */
int find_channels(const OIIO::ImageSpec &spec, int channels[4], bool *alpha) {
    int count = 0;
    for (const char *name : {"R", "G", "B"})
        if (const int at = spec.channelindex(name); at >= 0) channels[count++] = at;
    if (count != 3) {
        const int grey = spec.channelindex("Y");
        if (spec.nchannels > 1 && (grey < 0 || spec.channelindex("RY") >= 0))
            throw std::runtime_error("its channels are neither R, G and B nor Y alone");
        channels[0] = grey >= 0 ? grey : 0;
        count = 1;
    }
    const int at = spec.channelindex("A");
    *alpha = at >= 0 && at != channels[0];
    if (*alpha) channels[count++] = at;
    return count;
}

/* Of a picture that was opened with the wish for straight colors. */
bool is_associated(const OIIO::ImageSpec &spec, bool alpha) {
    return alpha && !spec.get_int_attribute("oiio:UnassociatedAlpha");
}

/* What an input says went wrong, which may be that there was no memory for it. */
[[noreturn]] void fail_input(const OIIO::ImageInput &input) {
    const std::string why = input.geterror();
    if (why.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
    throw std::runtime_error(why.empty() ? "the file is damaged" : why);
}

/* TIFF in strips goes row by row: OpenImageIO passes over damaged and missing ones when it reads
 * all at once, and notes at best that it did. The last row of OpenEXR goes first, lest a file that
 * ends early is decoded up to there. */
bool read_samples(OIIO::ImageInput &input, int first, int last, OIIO::TypeDesc type, void *to) {
    const OIIO::ImageSpec spec = input.spec();
    const bool in_rows = !std::strcmp(input.format_name(), "tiff") && !spec.tile_width &&
                         spec.get_string_attribute("planarconfig", "contig") == "contig";
    const int end = spec.y + spec.height;
    if (!std::strcmp(input.format_name(), "openexr") && !spec.tile_width &&
        !input.read_scanlines(0, 0, end - 1, end, spec.z, first, last, type, to))
        return false;
    if (!in_rows) return input.read_image(0, 0, first, last, type, to) && !input.has_error();
    const size_t row = type.size() * (last - first) * spec.width;
    auto *at = static_cast<char *>(to);
    for (int y = spec.y; y < end; y++, at += row)
        if (!input.read_scanlines(0, 0, y, y + 1, spec.z, first, last, type, at)) return false;
    return !input.has_error();
}

void read_picture(shd_oiio_file &file) {
    OIIO::ImageSpec straight;
    straight.attribute("oiio:UnassociatedAlpha", 1);
    auto input = OIIO::ImageInput::open(file.path, &straight);
    if (!input) throw std::runtime_error(OIIO::geterror());
    const OIIO::ImageSpec spec = input->spec();
    file.found_width = spec.width;
    file.found_height = spec.height;
    if (!file.width &&
        (spec.width < 1 || spec.height < 1 ||
         static_cast<size_t>(spec.width) > file.most / static_cast<size_t>(spec.height)))
        return;
    if (file.width && (spec.width != file.width || spec.height != file.height)) return;
    int channels[4];
    file.count = find_channels(spec, channels, &file.alpha);
    file.associated = is_associated(spec, file.alpha);
    const OIIO::TypeDesc type = spec.channelformat(channels[0]);
    file.depth = type == OIIO::TypeDesc::UINT8    ? SHD_U8
                 : type == OIIO::TypeDesc::UINT16 ? SHD_U16
                 : type == OIIO::TypeDesc::HALF   ? SHD_HALF
                                                  : SHD_FLOAT;
    const size_t pixels = static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height),
                 count = static_cast<size_t>(file.count), all = static_cast<size_t>(spec.nchannels);
    std::vector<float> whole(pixels * all);
    if (!read_samples(*input, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, whole.data()))
        fail_input(*input);
    file.values = static_cast<float *>(std::malloc(pixels * count * sizeof(float)));
    if (!file.values) throw std::bad_alloc();
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < count; c++)
            file.values[i * count + c] = whole[i * all + static_cast<size_t>(channels[c])];
}

/* Of a file. OpenEXR decodes all of them, whichever are wanted, and the limits of pixels and memory
 * do not count those that are not. */
constexpr int most_channels = 16;

void decode_picture(shd_oiio_decoding &d) {
    OIIO::Filesystem::IOMemReader bytes(const_cast<unsigned char *>(d.data), d.size);
    OIIO::ImageSpec straight;
    straight.attribute("oiio:UnassociatedAlpha", 1);
    const std::string name = std::string("memory.") + d.suffix;
    /* By the format's name: with a file's name it opens the file now, and tries all formats on one
     * that is damaged, of which some start threads. */
    auto input = OIIO::ImageInput::create(d.suffix);
    if (!input) throw std::runtime_error(OIIO::geterror());
    OIIO::ImageSpec spec;
    if (!input->set_ioproxy(&bytes)) throw std::runtime_error("it is not read from memory");
    if (!input->open(name, spec, straight)) fail_input(*input);
    if (spec.deep) throw std::runtime_error("it is a deep picture, of many samples a pixel");
    if (spec.depth > 1) throw std::runtime_error("it is a volume, not a picture");
    if (spec.nchannels > most_channels)
        throw std::runtime_error("it has " + std::to_string(spec.nchannels) +
                                 " channels; pictures of 16 at most are read");
    d.width = spec.width;
    d.height = spec.height;
    int channels[4];
    d.count = find_channels(spec, channels, &d.alpha);
    d.associated = is_associated(spec, d.alpha);
    const int first = *std::min_element(channels, channels + d.count),
              last = *std::max_element(channels, channels + d.count) + 1, read = last - first;
    const OIIO::TypeDesc type = spec.channelformat(channels[0]);
    d.depth = type == OIIO::TypeDesc::UINT8    ? SHD_U8
              : type == OIIO::TypeDesc::UINT16 ? SHD_U16
                                               : SHD_FLOAT;
    if (!d.admit(d.context, &d)) throw Stopped();

    const OIIO::TypeDesc to = stored_type(d.depth);
    const size_t pixels = static_cast<size_t>(d.width) * static_cast<size_t>(d.height),
                 sample = to.size(), count = static_cast<size_t>(d.count),
                 all = static_cast<size_t>(read);
    auto *samples = static_cast<unsigned char *>(std::malloc(pixels * all * sample));
    if (!samples) throw std::bad_alloc();
    d.samples = samples;
    if (!read_samples(*input, first, last, to, samples)) fail_input(*input);
    bool as_wanted = all == count;
    for (int c = 0; c < d.count; c++) as_wanted = as_wanted && channels[c] == first + c;
    /* In place, from the front: a pixel's samples are not more than what was read of it. */
    for (size_t i = 0; i < pixels && !as_wanted; i++) {
        unsigned char pixel[most_channels * sizeof(float)];
        std::memcpy(pixel, samples + i * all * sample, all * sample);
        for (size_t c = 0; c < count; c++)
            std::memcpy(samples + (i * count + c) * sample,
                        pixel + static_cast<size_t>(channels[c] - first) * sample, sample);
    }
}

} // namespace

extern "C" __attribute__((visibility("default"))) int shd_oiio_read(shd_oiio_file *file, char *text,
                                                                    size_t text_size) {
    return shielded(file->abi == sizeof *file, text, text_size, [&] {
        file->values = nullptr;
        read_picture(*file);
        return 0;
    });
}

extern "C" __attribute__((visibility("default"))) int
shd_oiio_decode(shd_oiio_decoding *decoding, char *text, size_t text_size) {
    return shielded(decoding->abi == sizeof *decoding, text, text_size, [&] {
        decoding->samples = nullptr;
        try {
            decode_picture(*decoding);
        } catch (...) {
            std::free(decoding->samples);
            decoding->samples = nullptr;
            throw;
        }
        return 0;
    });
}
