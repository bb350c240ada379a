/* The inside of the module: OBJ and MTL files as assimp 5.2 reads them, which takes other spellings
 * of numbers and other statements for damage. */
#pragma once

#include <stdio.h>

/* A file's text from its beginning on, without what assimp cannot read; it owns `file`, and returns
 * it if nothing is to be changed or its name ends in no .obj or .mtl. NULL: there is no room.
 *
 * OBJ: numbers that begin with their point get a 0 before. MTL: `d -halo` becomes `d`; spectral
 * curves (`Kd spectral`, `Kd xyz`), `decal`, `aniso` and `anisor` are blank lines. */
FILE *shd_respell(FILE *file, const char *path);
