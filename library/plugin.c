// The plugins, for programs without Python: mj_loadPluginLibrary registers them.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "library.h"

// MuJoCo's mjpPlugin.
typedef struct {
  const char *name;
  int nattribute;
  const char *const *attributes;
  int capabilityflags, needstage;
  void *nstate, *nsensordata, *init, *destroy, *copy, *reset, *compute, *advance;
  void *unused[8];  // functions for other kinds of plugins
} Plugin;

// Functions of MuJoCo.
int mj_version(void);
const Plugin *mjp_getPlugin(const char *name, int *slot);
int mjp_registerPlugin(const Plugin *plugin);

// ---- Functions that need no compiled code
static int nstate_of_plugin(const void *model, int instance) {
  (void)model, (void)instance;
  return 0;
}

static int nsensordata_of_plugin(const void *model, int instance, int sensor) {
  (void)model, (void)instance, (void)sensor;
  return 3;
}

static void reset_of_plugin(const void *model, double *state, void *data, int instance) {
  (void)model, (void)state, (void)data, (void)instance;
}

#include "plugins.inc"

static void *const slots[] = {
    &magmotor_cell_magmotor_plugin_slot,
    &magmotor_cell_magmotor_magnetometer_slot,
};

static const struct {
  int number;
  const char *name;
  int64_t offsets[OFFSETS];
} versions[] = {
#define VERSION(number, name, ...) {number, name, {__VA_ARGS__}},
#include "versions.inc"
#undef VERSION
};

enum { PLUGINS = sizeof plugins / sizeof *plugins, VERSIONS = sizeof versions / sizeof *versions };

static int registered;

// Whether a program without Python uses this library, so that Python must not bind other cells.
SHARED int magmotor_is_registered(void) { return registered; }

static int set_offsets_of(int number) {
  for (int k = 0; k < VERSIONS; k++)
    if (versions[k].number == number) {
      memcpy(magmotor_offsets, versions[k].offsets, sizeof magmotor_offsets);
      return 1;
    }
  return 0;
}

static void refuse_version(int number) {
  fprintf(stderr, "magmotor: nothing is registered: MuJoCo %d.%d.%d is unknown; known are ",
          number / 1000000, number / 1000 % 1000, number % 1000);
  for (int k = 0; k < VERSIONS; k++) fprintf(stderr, "%s%s", k ? ", " : "", versions[k].name);
  fprintf(stderr, "\n");
}

// Python has its own plugins, and loads this library with MAGMOTOR_LIBRARY=0, which turns it off for
// C, too.
__attribute__((constructor)) static void register_plugins(void) {
  const char *mode = getenv("MAGMOTOR_LIBRARY"), *missing;
  if (mode && !strcmp(mode, "0")) return;
  if (!OF_MUJOCO(mj_version)) {
    fprintf(stderr, "magmotor: nothing is registered: MuJoCo is not loaded, or exports nothing\n");
    return;
  }
  if (!magmotor_is_supported()) {
    fprintf(stderr, "magmotor: nothing is registered: this library needs a processor with %s\n",
            LEVEL >= 4 ? "AVX-512 (x86-64-v4)" : "AVX2 and FMA (x86-64-v3)");
    return;
  }
  int version = OF_MUJOCO(mj_version)();
  if (!set_offsets_of(version)) {
    refuse_version(version);
    return;
  }
  if ((missing = magmotor_bind_mujoco())) {
    fprintf(stderr, "magmotor: nothing is registered: MuJoCo has no function %s\n", missing);
    return;
  }
  if (OF_MUJOCO(mjp_getPlugin)(plugins[0].name, 0)) return;  // another library has done so
  magmotor_note_handler();
  magmotor_read_responses();
  for (int k = 0; k < PLUGINS; k++)
    **(int64_t **)slots[k] = OF_MUJOCO(mjp_registerPlugin)(&plugins[k]);
  registered = 1;
}

// The control callback for models without the plugin: mjcb_control = magmotor_callback. It does
// nothing where nothing is registered.
SHARED void magmotor_callback(const void *model, void *data) {
  if (registered) ((void (*)(const void *, void *))CALLBACK)(model, data);
}
