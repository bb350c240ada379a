#include "image/spread.h"

shd_status shd_encode_no_memory(shd_error *error) {
    return shd_fail(error, SHD_MEMORY, "", "not enough memory to encode the picture");
}

shd_status shd_encode_cancelled(shd_error *error) {
    return shd_fail(error, SHD_CANCELLED, "", "the encoding was cancelled");
}

bool shd_encode_goes_on(const shd_image *image) {
    return !image->go_on || image->go_on(image->context);
}

unsigned shd_encode_slots(const shd_image *image) {
    return image->spread ? image->slots : 1;
}

typedef struct parts {
    const shd_image *image;
    void (*run)(void *work, size_t index, unsigned slot);
    void *work;
    atomic_bool cancelled;
} parts;

static void run_part(void *context, size_t index, unsigned slot) {
    parts *p = context;
    if (atomic_load(&p->cancelled)) return;
    if (slot == 0 && !shd_encode_goes_on(p->image))
        atomic_store(&p->cancelled, true);
    else
        p->run(p->work, index, slot);
}

bool shd_encode_spread(const shd_image *image, size_t count,
                       void (*run)(void *work, size_t index, unsigned slot), void *work) {
    parts p = {image, run, work, false};
    if (image->spread && count > 1)
        image->spread(image->context, count, run_part, &p);
    else
        for (size_t i = 0; i < count; i++) run_part(&p, i, 0);
    return !atomic_load(&p.cancelled);
}
