/* model.c and what it stands on, in floats of 113 bits. */
#define ATTACK_QUAD
#define cross_solid   cross_solid_quad
#define document_read document_read_quad
#define document_drop document_drop_quad
#define reflect_light reflect_light_quad
#define reflect_shape reflect_shape_quad
#include "attack/document.c"
#include "attack/model.c"
#include "attack/reflect.c"
#include "attack/solids.c"
