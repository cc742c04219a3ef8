// Functions of Numba and Python that compiled code refers to.
#include <stdint.h>
#include <stdlib.h>

#if defined(_WIN32)
#include <malloc.h>
#define aligned_alloc(alignment, size) _aligned_malloc(size, alignment)
#define free_aligned _aligned_free
#else
#define free_aligned free
#endif

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
  free_aligned(array->data);
  free(array);
}

// Compiled code reshapes only what `aligned` in magmotor/numerics/arrays.py returns, one row.
int numba_attempt_nocopy_reshape(int64_t axes, const int64_t *extents, const int64_t *strides,
                                 int64_t new_axes, const int64_t *new_extents, int64_t *new_strides,
                                 int64_t size, int columns_first) {
  (void)axes, (void)extents, (void)strides, (void)columns_first;
  for (int64_t k = new_axes - 1; k >= 0; size *= new_extents[k--]) new_strides[k] = size;
  return 1;
}

// ---- Other names of Numba and Python, for errors of Python, which the code does not raise
#define NEVER(name) \
  void name(void);  \
  void name(void) { abort(); }
#include "never.inc"
