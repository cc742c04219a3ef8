// What the files of the C part share.
#ifndef MAGMOTOR_LIBRARY_H_
#define MAGMOTOR_LIBRARY_H_

#include <stdint.h>

#include "numbers.h"

#if defined(_WIN32)
#define SHARED __declspec(dllexport)
#else
#define SHARED __attribute__((visibility("default")))
#endif

#define FUNCTION(k) extern char magmotor_function_##k[];
#include "functions.inc"
#undef FUNCTION

// Variables that the compiled code reads.
extern void *magmotor_cell_magmotor_plugin_slot, *magmotor_cell_magmotor_magnetometer_slot;
extern int64_t magmotor_offsets[OFFSETS];

SHARED int magmotor_is_supported(void);

// Return the address of a function or a variable of MuJoCo, or 0.
void *magmotor_of_mujoco(const char *name);
#define OF_MUJOCO(function) ((__typeof__(&function))magmotor_of_mujoco(#function))

// Let cells contain addresses in MuJoCo. Return the name of what it lacks, or 0.
const char *magmotor_bind_mujoco(void);

// Read the file of responses of iron that MAGMOTOR_RESPONSES names, if there is one.
void magmotor_read_responses(void);

// Learn which handler MuJoCo has unless the program sets another one.
void magmotor_note_handler(void);

// Functions that the compiled code calls, unless Python has others for it.
void magmotor_load(int64_t number);
int64_t magmotor_compute_response(int64_t key, int64_t geoms, int64_t head);
void magmotor_form_error(int64_t error, int64_t number, const char *name, int64_t other,
                         const char *other_name, const double *details, int64_t handler,
                         int64_t user, const char **text);
void magmotor_form_notice(int64_t which, int64_t number, const char *name, int64_t other,
                          const char *other_name, int64_t unless, int64_t handler, int64_t user,
                          const char **text);

#endif
