// What a program without Python does in tests: c_host LIBRARY TASK COUNT MODEL...
// LIBRARY may be a folder, with a slash at its end.
#include <dlfcn.h>
#include <malloc.h>
#include <mujoco/mujoco.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define END "\n\f\n"  // of an error

static const char *library;
static int count;
static jmp_buf caught;

static mjModel *loaded(const char *path) {
  char error[1000] = "";
  mjModel *m = mj_loadXML(path, NULL, error, sizeof error);
  if (*error) printf(m ? "%s\n" : "%s", error);
  if (!m) printf(END);
  return m;
}

static mjData *started(const mjModel *m) {
  mjData *d = mj_makeData(m);
  if (m->nkey > 0) mj_resetDataKeyframe(m, d, 0);
  return d;
}

static mjData *stepped(const mjModel *m) {
  mjData *d = started(m);
  for (int k = 0; k < count; k++) mj_step(m, d);
  return d;
}

static void finish(mjModel *m, mjData *d) {
  for (int k = 0; k < m->nq; k++) printf("%a ", d->qpos[k]);
  for (int k = 0; k < m->nv; k++) printf("%a ", d->qvel[k]);
  for (int k = 0; k < m->nsensordata; k++) printf("%a ", d->sensordata[k]);
  printf("\n");
  mj_deleteData(d);
}

// The state after some steps.
static void steps(mjModel *m) { finish(m, stepped(m)); }

// Where dipoles are in the first state, and what acts then.
static void forces(mjModel *m) {
  mjData *d = started(m);
  mj_forward(m, d);
  for (int k = 0; k < 3 * m->nsite; k++) printf("%a ", d->site_xpos[k]);
  for (int k = 0; k < 9 * m->nsite; k++) printf("%a ", d->site_xmat[k]);
  printf("\n");
  for (int k = 0; k < m->nv; k++) printf("%a ", d->qfrc_passive[k]);
  finish(m, d);
}

// The state after some steps by the control callback.
static void callback(mjModel *m) {
  mjcb_control = (mjfGeneric)dlsym(dlopen(library, RTLD_NOW), "magmotor_callback");
  steps(m);
  mjcb_control = NULL;
}

// The error of a step.
static void raise_error(const char *message) {
  printf("%s" END, message);
  longjmp(caught, 1);
}

static void step_once(mjModel *m) {
  mjData *volatile d = NULL;
  if (!setjmp(caught)) {
    d = started(m);
    mj_step(m, d);
    printf("no error" END);
  }
  mj_deleteData(d);
}

static void errors(mjModel *m) {
  mju_user_error = raise_error;
  step_once(m);
  mju_user_error = NULL;
}

// The same with a handler of MuJoCo's newer kind, and with one that returns.
static void raise_logged(const mjLogMessage *message) {
  if (message->level == mjLOG_ERROR) raise_error(message->subject);
}

static void logged(mjModel *m) {
  mju_setLogHandler(raise_logged);
  step_once(m);
  mju_setLogHandler(NULL);
}

static void print_logged(const mjLogMessage *message) {
  if (message->level == mjLOG_ERROR) printf("%s\n", message->subject);
}

static void returned(mjModel *m) {
  mju_setLogHandler(print_logged);
  steps(m);
  mju_setLogHandler(NULL);
}

// The same in a model that was changed after it was loaded.
static void indices(mjModel *m) {
  m->name_textadr[0] = -5;
  errors(m);
  m->name_textadr[0] = 0;
  m->tuple_size[0] = 1 << 20;
  errors(m);
  m->tuple_size[0] = 0;
  m->names[m->nnames - 1] = 'x';
  errors(m);
}

// Warnings, and the state after steps on a thread without a handler of errors.
static void print_warning(const char *message) { printf("%s\n", message); }

static void *step_alone(void *m) { return stepped(m); }

static void unhandled(mjModel *m) {
  pthread_t thread;
  void *d;
  mju_user_warning = print_warning;
  pthread_create(&thread, NULL, step_alone, m);
  pthread_join(thread, &d);
  finish(m, d);
}

// The states of several threads, of which each second one has threads of MuJoCo.
static void *step_in_pool(void *m) {
  mjData *d = started(m);
  mju_threadpool(d, 2);
  for (int k = 0; k < count; k++) mj_step(m, d);
  return d;
}

static void threads(mjModel *m) {
  enum { THREADS = 4 };
  pthread_t thread[THREADS];
  void *d;
  for (int k = 0; k < THREADS; k++)
    pthread_create(&thread[k], NULL, k % 2 ? step_in_pool : step_alone, m);
  for (int k = 0; k < THREADS; k++) {
    pthread_join(thread[k], &d);
    finish(m, d);
  }
}

// What MuJoCo knows of the plugins.
static void plugins(mjModel *m) {
  (void)m;
  for (int k = 0; k < mjp_pluginCount(); k++) {
    const mjpPlugin *p = mjp_getPluginAtSlot(k);
    printf("%s %d %s %d %d %d %d%d%d%d%d%d%d\n", p->name, p->nattribute,
           p->nattribute ? p->attributes[0] : "-", p->capabilityflags, p->needstage,
           p->nsensordata ? p->nsensordata(NULL, 0, 0) : 0, !!p->nstate, !!p->nsensordata,
           !!p->init, !!p->destroy, !!p->copy, !!p->reset, !!p->compute);
  }
}

// How many bytes more are in use after a model has been loaded many times, and after many steps.
static void leaks(mjModel *m) {
  size_t before = 0;
  for (int k = 0; k <= count; k++) {
    if (k == 1) before = mallinfo2().uordblks;
    mjModel *copy = mj_copyModel(NULL, m);
    mjData *d = started(copy);
    mj_step(copy, d);
    mj_deleteData(d);
    mj_deleteModel(copy);
  }
  mjData *d = stepped(m);
  mj_deleteData(d);
  printf("%lld\n", (long long)mallinfo2().uordblks - (long long)before);
}

int main(int argc, char **argv) {
  static const struct {
    const char *name;
    void (*run)(mjModel *m);
  } tasks[] = {
      {"steps", steps},     {"callback", callback}, {"errors", errors},   {"unhandled", unhandled},
      {"threads", threads}, {"leaks", leaks},       {"indices", indices}, {"plugins", plugins},
      {"logged", logged},   {"returned", returned}, {"forces", forces},
  };
  if (argc < 4) return 2;
  library = argv[1];
  count = atoi(argv[3]);
  if (library[strlen(library) - 1] == '/')
    mj_loadAllPluginLibraries(library, NULL);
  else
    mj_loadPluginLibrary(library);
  for (int k = 4; k < argc; k++) {
    mjModel *m = loaded(argv[k]);
    for (size_t t = 0; m && t < sizeof tasks / sizeof *tasks; t++)
      if (!strcmp(tasks[t].name, argv[2])) tasks[t].run(m);
    mj_deleteModel(m);
  }
}
