"""Pressed balloons, computed by a finite-element program that shares no equation with the estimators.

**Program.** felupe 11.3.0 with tensortrax 0.29.0, numpy 2.4.6, scipy 1.17.1 and Python 3.11. The solid,
the elements, the laws `mooney-rivlin` and `ogden`, the contact with friction (`ContactRigidPlane`) and
the Newton method are those of felupe. Added here: the locked gas (`gas.py`) and the energy of Gent
(`materials.py`).

**Balloon.** Sphere with the mid-surface radius 7.503 mm and the thickness 0.2 mm at rest. The outer
radius at rest, which a caliper measures, is therefore 7.603 mm. The gas fills the volume inside the inner
surface. One-sided: a plate presses one half. The equator of this half stays in its plane and moves freely
in this plane. The other half has the volume of a free half balloon at the same pressure. Two-sided: both
halves are pressed.

**Mesh.** 100 elements along the quarter of the meridian and 2 through the wall: axisymmetric
quadrilaterals with linear displacements, and with constant pressure and constant volume ratio. The rubber
has a bulk modulus of 2 GPa.

**Contact.** Penalty method with Coulomb friction, in steps of at most 0.04 mm. A sticking point moves by
at most 0.001 mm. The indentation is the travel of the plate since the first touch. The contact radius is
the radius at which the outer surface leaves the plate.

**Tables.** `pressed_balloons.csv` contains 62 cases with 12 forces each, interpolated along the path.
`balloon_mm3` is the volume of the whole balloon. `free_radii.csv` contains the outer radius of the
equator (`radius_mm`) and the radius of the mid-surface.

**Convergence** (`convergence.py`). With half the number of elements along the meridian, the rises at 0.5
to 3.5 N change by 0.2 % or less, and with twice the number by 0.05 % or less. With four elements through
the wall, half the steps, half the elastic slip or a stiffer contact, they change by less than 0.1 %.
These changes were measured for one case: `mooney-rivlin`, 8 kPa, one-sided, friction 0.2. The contact
radius changes by up to 0.03 mm.

**Comparison** (`summary.py`). The rises are 0.7 % to 1.3 % smaller than those of a thin membrane with the
same mid-surface. With friction 1, the rises are those of a skin that sticks completely.
"""
