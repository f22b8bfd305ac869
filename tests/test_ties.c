/* Keys of three bits for the canonical order: nearly always two agree, and the vertices decide. */
#define DELAUNAY__SHORT_KEY_MASK 0x80000003u
#include "test_delaunay.c"
