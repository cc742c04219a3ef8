// Steps a MuJoCo model with magnets, in a program without Python.
//
//   magnets LIBRARY MODEL.xml SECONDS
//
// Prints the time, the position and velocity of the last body that moves freely, and its spin J,
// the angular velocity about the vertical axis, all with 17 digits; without such a body, all joints.
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>

static void print(const char *name, const mjtNum *numbers, int count) {
  printf("%s", name);
  for (int k = 0; k < count; k++) printf(" %.17g", numbers[k]);
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

  int ball = -1;
  for (int joint = 0; joint < m->njnt; joint++)
    if (m->jnt_type[joint] == mjJNT_FREE) ball = joint;
  int q = ball < 0 ? 0 : m->jnt_qposadr[ball], v = ball < 0 ? 0 : m->jnt_dofadr[ball];
  print("time", &d->time, 1);
  print("qpos", d->qpos + q, ball < 0 ? (int)m->nq : 7);
  print("qvel", d->qvel + v, ball < 0 ? (int)m->nv : 6);
  if (ball >= 0) {
    mj_kinematics(m, d);
    mjtNum spin[3];
    mju_mulMatVec3(spin, d->xmat + 9 * m->jnt_bodyid[ball], d->qvel + v + 3);
    print("J", spin + 2, 1);
  }
  mj_deleteData(d);
  mj_deleteModel(m);
}
