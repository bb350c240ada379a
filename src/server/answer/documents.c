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
static shd_text make_text(const void *data, size_t size) {
    shd_text text = {.data = data, .size = size};
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ ((const unsigned char *)data)[i]) * UINT64_C(0x100000001b3);
    snprintf(text.etag, sizeof text.etag, "%016" PRIx64, hash);
    return text;
}

static void set_document(shd_document *document, const char *media_type, const void *data,
                         size_t size, bool owned) {
    *document = (shd_document){media_type, owned, .plain = make_text(data, size)};
    size_t less;
    const void *gzip = shd_gzip(data, size, &less);
    if (gzip) document->gzip = make_text(gzip, less);
}

void shd_document_lend(shd_document *document, const char *media_type, const void *data,
                       size_t size) {
    set_document(document, media_type, data, size, false);
}

static char *make_index(void) {
    json_t *routes = json_array();
    for (shd_route i = 0; i < SHD_ROUTE_OTHER; i++) {
        json_t *methods = json_array();
        for (size_t m = 0; m < SHD_METHODS; m++)
            if (shd_paths[i].methods & 1 << m)
                json_array_append_new(methods, json_string(shd_method_names[m]));
        json_array_append_new(
            routes, json_pack("{s:s, s:o}", "path", shd_paths[i].path, "methods", methods));
    }
    json_t *index = json_pack("{s:s, s:s, s:s, s:o}", "name", "shaded", "version", shd_version(),
                              "openapi", "/openapi.yaml", "routes", routes);
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

void shd_documents_release(const shd_document documents[SHD_ROUTE_COUNT]) {
    for (size_t i = 0; i < SHD_ROUTE_COUNT; i++) {
        if (documents[i].owned) free((void *)(size_t)documents[i].plain.data);
        free((void *)(size_t)documents[i].gzip.data);
    }
}
