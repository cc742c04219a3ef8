// The C part of the library: what compiled code needs that is not in it.
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "offsets.h"

#define SHARED __attribute__((visibility("default")))

// ---- Cells, which contain the addresses of MuJoCo's functions and of our variables
#define CELL(name) void *magmotor_cell_##name;
#include "cells.inc"
#undef CELL

static const struct {
  const char *name;
  void **cell;
} cells[] = {
#define CELL(name) {#name, &magmotor_cell_##name},
#include "cells.inc"
#undef CELL
};

// ---- The layout of MuJoCo's structs, as numbers that compiled code reads
int64_t magmotor_offsets[OFFSETS];

SHARED void magmotor_set_offsets(const int64_t *offsets) {
  memcpy(magmotor_offsets, offsets, sizeof magmotor_offsets);
}

SHARED int magmotor_bind(const char *name, void *address) {
  for (size_t k = 0; k < sizeof cells / sizeof *cells; k++)
    if (!strcmp(cells[k].name, name)) {
      *cells[k].cell = address;
      return 1;
    }
  return 0;
}

// ---- Functions, by their numbers in the description
#define FUNCTION(k) extern char magmotor_function_##k[];
#include "functions.inc"
#undef FUNCTION

static void *const functions[] = {
#define FUNCTION(k) magmotor_function_##k,
#include "functions.inc"
#undef FUNCTION
};

SHARED void *magmotor_function(int number) { return functions[number]; }

SHARED int magmotor_is_supported(void) {
#if defined(__x86_64__)
  if (LEVEL >= 4 && !__builtin_cpu_supports("x86-64-v4")) return 0;
  if (!__builtin_cpu_supports("x86-64-v3")) return 0;
#endif
  return 1;
}

// ---- Arrays that compiled code allocates for a while, as in Numba's nrt.h
typedef struct {
  size_t references;
  void (*destructor)(void *, size_t, void *);
  void *information, *data;
  size_t size;
  void *allocator;
} Array;

void *NRT_MemInfo_alloc_aligned(int64_t size, uint32_t alignment) {
  Array *array = calloc(1, sizeof *array);
  size_t room = ((size_t)size + alignment) / alignment * alignment;
  if (!array || !(array->data = aligned_alloc(alignment, room))) abort();
  array->references = 1;
  array->size = (size_t)size;
  return array;
}

void NRT_MemInfo_call_dtor(Array *array) {
  free(array->data);
  free(array);
}

int numba_attempt_nocopy_reshape(int64_t axes, const int64_t *extents, const int64_t *strides,
                                 int64_t new_axes, const int64_t *new_extents,
                                 int64_t *new_strides, int64_t size, int columns_first) {
  int64_t stride = size;
  for (int64_t k = axes - 1; k >= 0; stride *= extents[k--])
    if (columns_first || strides[k] != stride) return 0;
  stride = size;
  for (int64_t k = new_axes - 1; k >= 0; stride *= new_extents[k--]) new_strides[k] = stride;
  return 1;
}

// ---- Other names of Numba and Python, for errors of Python, which the code does not raise
#define NEVER(name)     \
  void name(void);      \
  void name(void) { abort(); }
#include "never.inc"
