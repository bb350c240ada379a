#include "documents.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gzip.h"

/* The files of api/, embedded by the build. */
extern const unsigned char shd_embedded_openapi[], shd_embedded_openapi_json[],
    shd_embedded_schema[];
extern const unsigned long shd_embedded_openapi_size, shd_embedded_openapi_json_size,
    shd_embedded_schema_size;

static const char media_json[] = "application/json";

/* FNV-1a, 64 bits: the tag tells versions of our own texts apart, nothing more. */
static void set_text(shd_text *text, const void *data, size_t size, bool owned) {
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ ((const unsigned char *)data)[i]) * UINT64_C(0x100000001b3);
    *text = (shd_text){.data = data, .size = size, .owned = owned};
    snprintf(text->etag, sizeof text->etag, "%016" PRIx64, hash);
}

static void set_document(shd_document *document, const char *media_type, const void *data,
                         size_t size, bool owned) {
    document->media_type = media_type;
    set_text(&document->plain, data, size, owned);
    size_t less;
    void *gzip = shd_gzip(data, size, &less);
    if (gzip) set_text(&document->gzip, gzip, less, true);
}

static json_t *list_methods(unsigned methods) {
    json_t *list = json_array();
    for (size_t i = 0; i < SHD_METHODS; i++)
        if (methods & shd_method_names[i].method)
            json_array_append_new(list, json_string(shd_method_names[i].name));
    return list;
}

static char *make_index(void) {
    json_t *list = json_array();
    for (shd_route i = 0; i < SHD_ROUTE_OTHER; i++) {
        json_t *route = json_object();
        json_object_set_new(route, "path", json_string(shd_paths[i].path));
        json_object_set_new(route, "methods", list_methods(shd_paths[i].methods));
        json_array_append_new(list, route);
    }
    json_t *index = json_object();
    json_object_set_new(index, "name", json_string("shaded"));
    json_object_set_new(index, "version", json_string(shd_version()));
    json_object_set_new(index, "openapi", json_string("/openapi.yaml"));
    json_object_set_new(index, "routes", list);
    char *text = json_dumps(index, JSON_INDENT(2));
    json_decref(index);
    return text;
}

shd_status shd_documents_make(shd_engine *engine, shd_document documents[SHD_ROUTE_COUNT],
                              shd_error *error) {
    static const struct {
        shd_route route;
        shd_topic topic;
    } topics[] = {{SHD_ROUTE_MATERIALS, SHD_TOPIC_MATERIALS},
                  {SHD_ROUTE_SHAPES, SHD_TOPIC_SHAPES},
                  {SHD_ROUTE_COLORSPACES, SHD_TOPIC_COLORSPACES},
                  {SHD_ROUTE_VERSION, SHD_TOPIC_VERSION}};
    for (size_t i = 0; i < sizeof topics / sizeof topics[0]; i++) {
        char *json;
        shd_status status = shd_engine_describe(engine, topics[i].topic, &json, error);
        if (status) return status;
        set_document(&documents[topics[i].route], media_json, json, strlen(json), true);
    }
    char *index = make_index();
    if (!index) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the list of routes");
    set_document(&documents[SHD_ROUTE_INDEX], media_json, index, strlen(index), true);
    set_document(&documents[SHD_ROUTE_OPENAPI], "application/yaml", shd_embedded_openapi,
                 shd_embedded_openapi_size, false);
    set_document(&documents[SHD_ROUTE_OPENAPI_JSON], media_json, shd_embedded_openapi_json,
                 shd_embedded_openapi_json_size, false);
    set_document(&documents[SHD_ROUTE_SCHEMA], "application/schema+json", shd_embedded_schema,
                 shd_embedded_schema_size, false);
    return SHD_OK;
}

static void release_text(const shd_text *text) {
    if (text->owned) free((void *)(size_t)text->data);
}

void shd_documents_release(const shd_document documents[SHD_ROUTE_COUNT]) {
    for (size_t i = 0; i < SHD_ROUTE_COUNT; i++) {
        release_text(&documents[i].plain);
        release_text(&documents[i].gzip);
    }
}
