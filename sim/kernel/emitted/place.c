/* Feet, then knees in the world, x, y, z each [m]. */
static void place_feet(const vec *q, const double *robot, vec (*places)[6])
{
  static const int start[$limbs] = { $starts }, kind[$limbs] = { $kinds };
  for (int l = 0; l < $limbs; l++) {
    switch (kind[l]) {
$calls
    }
  }
}
