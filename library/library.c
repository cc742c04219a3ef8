// What compiled code needs: cells, offsets, and the numbers of functions.
#include "library.h"

#include <stddef.h>
#include <string.h>

// ---- Cells, which contain the addresses of functions and variables. Python binds its own.
#include "variables.inc"

#define CELL(name, initial) void *magmotor_cell_##name = initial;
#define MUJOCO(name, initial) CELL(name, 0)
#include "cells.inc"
#undef CELL

static const struct {
  const char *name;
  void **cell;
} cells[] = {
#define CELL(name, initial) {#name, &magmotor_cell_##name},
#include "cells.inc"
#undef CELL
};

SHARED int magmotor_bind(const char *name, void *address) {
  for (size_t k = 0; k < sizeof cells / sizeof *cells; k++)
    if (!strcmp(cells[k].name, name)) {
      *cells[k].cell = address;
      return 1;
    }
  return 0;
}

const char *magmotor_bind_mujoco(void) {
  for (size_t k = 0; k < sizeof cells / sizeof *cells; k++)
    if (!*cells[k].cell && !(*cells[k].cell = magmotor_of_mujoco(cells[k].name)))
      return cells[k].name;
  return 0;
}

void magmotor_load(int64_t number) { (void)number; }  // here, all functions are loaded

// ---- The layout of MuJoCo's structs, as numbers that compiled code reads
int64_t magmotor_offsets[OFFSETS];

SHARED void magmotor_set_offsets(const int64_t *offsets) {
  memcpy(magmotor_offsets, offsets, sizeof magmotor_offsets);
}

// ---- Functions, by their numbers in the description
static void *const functions[] = {
#define FUNCTION(k) magmotor_function_##k,
#include "functions.inc"
#undef FUNCTION
};

SHARED void *magmotor_function(int number) { return functions[number]; }

SHARED int magmotor_is_supported(void) {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (LEVEL >= 4 && !__builtin_cpu_supports("x86-64-v4")) return 0;
  if (!__builtin_cpu_supports("x86-64-v3")) return 0;
#endif
  return 1;
}
