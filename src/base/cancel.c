#include "base/cancel.h"

bool shd_is_cancelled(const atomic_bool *flag) {
    return flag && atomic_load_explicit(flag, memory_order_relaxed);
}
