#include "scene/quick.h"

#include <simdjson.h>

#include <cstring>
#include <string_view>

namespace {

namespace dom = simdjson::dom;

constexpr size_t DEEPEST = 64;
constexpr size_t BETWEEN_LOOKS = 1024; // values

static_assert(SHD_QUICK_PADDING >= simdjson::SIMDJSON_PADDING, "simdjson reads that far");

// Makes jansson's values of simdjson's. A null pointer is an end of it all: nothing has to be freed
// then but what is on the way back.
class Maker {
  public:
    Maker(bool (*asked)(void *), void *with) : stops(asked), context(with) {}

    json_t *make(dom::element value) {
        if (values++ % BETWEEN_LOOKS == 0 && stops(context)) return nullptr;
        switch (value.type()) {
        case dom::element_type::OBJECT:
            return make_object(dom::object(value.get_object().value_unsafe()));
        case dom::element_type::ARRAY:
            return make_array(dom::array(value.get_array().value_unsafe()));
        case dom::element_type::STRING: {
            const std::string_view text = value.get_string().value_unsafe();
            return json_stringn_nocheck(text.data(), text.size());
        }
        case dom::element_type::DOUBLE:
            return json_real(value.get_double().value_unsafe());
        case dom::element_type::INT64:
            return json_real(static_cast<double>(value.get_int64().value_unsafe()));
        case dom::element_type::UINT64:
            return json_real(static_cast<double>(value.get_uint64().value_unsafe()));
        case dom::element_type::BOOL:
            return json_boolean(value.get_bool().value_unsafe());
        case dom::element_type::NULL_VALUE:
            return json_null();
        }
        return nullptr;
    }

  private:
    json_t *make_object(dom::object members) {
        json_t *object = json_object();
        size_t count = 0;
        for (auto at = members.begin(); object && at != members.end(); ++at, ++count) {
            const std::string_view key = at.key();
            json_t *value = make(at.value());
            // One that is there already is replaced.
            if (!value || json_object_setn_new_nocheck(object, key.data(), key.size(), value) ||
                json_object_size(object) == count) {
                json_decref(object);
                object = nullptr;
            }
        }
        return object;
    }

    json_t *make_array(dom::array items) {
        json_t *array = json_array();
        for (auto at = items.begin(); array && at != items.end(); ++at) {
            json_t *value = make(*at);
            if (!value || json_array_append_new(array, value)) {
                json_decref(array);
                array = nullptr;
            }
        }
        return array;
    }

    bool (*stops)(void *);
    void *context;
    size_t values = 0; // that were begun
};

// Whether an integer may be -0, whose sign simdjson loses.
bool has_negative_zero(std::string_view text) {
    for (size_t at = 0; (at = text.find("-0", at)) != text.npos; at += 2) {
        const bool is_exponent = at && (text[at - 1] == 'e' || text[at - 1] == 'E');
        if (!is_exponent && (at + 2 == text.size() || text[at + 2] != '.')) return true;
    }
    return false;
}

} // namespace

// The tape, the strings, and where each token begins: of each byte one at most.
size_t shd_quick_working(size_t length) {
    const size_t fixed = 8192;
    return length > (SIZE_MAX - fixed) / 14 ? SIZE_MAX : fixed + 14 * length;
}

json_t *shd_quick_tree(const char *text, size_t length, bool stops(void *context), void *context) {
    // Newer versions of simdjson step over a byte order mark, which jansson refuses.
    if (!length || text[0] == '\xef' || has_negative_zero({text, length})) return nullptr;
    try {
        dom::parser parser;
        dom::element root;
        if (parser.allocate(length, DEEPEST) || parser.parse(text, length, false).get(root))
            return nullptr;
        return Maker(stops, context).make(root);
    } catch (...) {
        return nullptr;
    }
}
