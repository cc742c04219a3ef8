// Steps a MuJoCo model with magnets, in a program without Python.
//
//   magnets LIBRARY MODEL.xml SECONDS
//
// Prints the time and all coordinates and velocities with 17 digits and, if there is a body named
// ball, its spin: the angular velocity about the vertical axis.
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>

static void print(const char *name, const mjtNum *numbers, mjtSize count) {
  printf("%s", name);
  for (mjtSize k = 0; k < count; k++) printf(" %.17g", numbers[k]);
  printf("\n");
}

int main(int argc, char **argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: %s LIBRARY MODEL.xml SECONDS\n", argv[0]);
    return 2;
  }
  mj_loadPluginLibrary(argv[1]);

  char error[1000] = "";
  mjModel *m = mj_loadXML(argv[2], NULL, error, sizeof error);
  if (!m) {
    fprintf(stderr, "%s\n", error);
    return 1;
  }
  mjData *d = mj_makeData(m);
  while (d->time < atof(argv[3])) mj_step(m, d);
  print("time", &d->time, 1);
  print("qpos", d->qpos, m->nq);
  print("qvel", d->qvel, m->nv);

  int ball = mj_name2id(m, mjOBJ_BODY, "ball");
  if (ball >= 0) {
    mjtNum velocity[6];
    mj_forward(m, d);
    mj_objectVelocity(m, d, mjOBJ_BODY, ball, velocity, 0);
    print("spin", &velocity[2], 1);
  }
  mj_deleteData(d);
  mj_deleteModel(m);
}
