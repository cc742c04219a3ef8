// Finds MuJoCo, whose symbols are not visible if it was loaded with RTLD_LOCAL, as in ROS 2.
#define _GNU_SOURCE
#include <stddef.h>

#include "library.h"

#if defined(_WIN32)
#define WIN32_LEAN_AND_MEAN
#include <windows.h>

static void *symbol(void *object, const char *name) {
  return (void *)GetProcAddress((HMODULE)object, name);
}

static void *find_mujoco(void) {
  void *found = GetModuleHandleA("mujoco.dll"), *program = GetModuleHandleA(0);
  return found || !symbol(program, "mj_version") ? found : program;
}

#else
#include <dlfcn.h>

static void *symbol(void *object, const char *name) { return dlsym(object, name); }

// Return an object that has been loaded, if it contains MuJoCo.
static void *mujoco_in(const char *path) {
  void *object = dlopen(path, RTLD_LAZY | RTLD_NOLOAD);
  if (!object || symbol(object, "mj_version")) return object;
  dlclose(object);
  return 0;
}

#if defined(__APPLE__)
#include <mach-o/dyld.h>

static void *find_mujoco(void) {
  void *found = mujoco_in(0);
  for (uint32_t k = 0; !found && k < _dyld_image_count(); k++)
    found = mujoco_in(_dyld_get_image_name(k));
  return found;
}

#else
#include <link.h>

// These symbols have new versions, which libraries for older versions of glibc must not need.
#if defined(__x86_64__)
#define OLDEST "@GLIBC_2.2.5"
#else
#define OLDEST "@GLIBC_2.17"
#endif
__asm__(".symver dlopen, dlopen" OLDEST);
__asm__(".symver dlsym, dlsym" OLDEST);
__asm__(".symver dlclose, dlclose" OLDEST);

static int visit(struct dl_phdr_info *object, size_t size, void *found) {
  (void)size;
  return (*(void **)found = mujoco_in(object->dlpi_name)) != 0;
}

static void *find_mujoco(void) {
  void *found = 0;
  dl_iterate_phdr(visit, &found);
  return found;
}
#endif
#endif

void *magmotor_of_mujoco(const char *name) {
  static void *mujoco;
  if (!mujoco) mujoco = find_mujoco();
  return mujoco ? symbol(mujoco, name) : 0;
}
