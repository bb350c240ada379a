/* model.c and what it stands on, in floats of 113 bits. */
#define ATTACK_QUAD
#define cross_solid      cross_solid_quad
#define document_read    document_read_quad
#define document_drop    document_drop_quad
#define facets_cut       facets_cut_quad
#define light_cases_only light_cases_only_quad
#define light_place      light_place_quad
#define occlude_point    occlude_point_quad
#define occlude_shape    occlude_shape_quad
#define printed_stuff    printed_stuff_quad
#define reflect_light    reflect_light_quad
#define reflect_shape    reflect_shape_quad
#define sky_cut          sky_cut_quad
#define sky_light        sky_light_quad
#include "attack/document.c"
#include "attack/facets.c"
#include "attack/light.c"
#include "attack/model.c"
#include "attack/occlude.c"
#include "attack/prints.c"
#include "attack/reflect.c"
#include "attack/sky.c"
#include "attack/solids.c"
