"""Half a spherical balloon as an axisymmetric solid of felupe, and its free inflation.

The half balloon reaches from the equator (x = 0) to the pole on the axis (r = 0). Units: mm, kPa and mN.
"""

from dataclasses import dataclass

import felupe as fem
import numpy as np

from tests.instrument.model.foreign_balloon.gas import LockedGas, half_volume_mm3

MID_RADIUS_MM, THICKNESS_MM = 7.503, 0.2
#: Elements along the quarter of the meridian, and elements through the wall.
ELEMENTS, LAYERS = 100, 2
#: At this modulus, the volume of the rubber changes by less than 0.03 %.
BULK_MODULUS_KPA = 2e6
#: Largest sum of the residual forces, as a share of the reactions of plate and equator.
TOLERANCE = 1e-7


@dataclass
class Balloon:
    """Mesh, field, solid and gas of a half balloon. `outer` and `inner`: point numbers, equator to pole."""

    mesh: fem.Mesh
    field: fem.FieldContainer
    solid: fem.SolidBodyNearlyIncompressible
    gas: LockedGas
    outer: np.ndarray
    inner: np.ndarray
    #: Number of the point that carries the rigid plate.
    plate: int
    #: Prescribed displacements. The displacement of the plate along the axis can be changed.
    boundaries: dict

    def positions_mm(self, points):
        """Return the present axial and radial coordinates of points in mm, shape (points, 2)."""
        return self.mesh.points[points] + self.field[0].values[points]

    def equator_mm(self):
        """Return the present radius of the equator in mm: on the outer surface, and on the mid-surface."""
        outer, inner = self.positions_mm([self.outer[0], self.inner[0]])[:, 1]
        return outer, (outer + inner) / 2

    def half_volume_mm3(self):
        """Return the present volume inside the half balloon in mm³."""
        return half_volume_mm3(self.positions_mm(self.inner))

    def displacements_mm(self):
        """Return a copy of the displacements in mm, shape (points, 2)."""
        return self.field[0].values.copy()

    def restore(self, displacements_mm):
        """Set the displacements, and the pressure inside the rubber that belongs to them."""
        self.field[0].values[:] = displacements_mm
        self.solid.restore(self.solid.checkpoint(), restore_state=False)

    def move_plate(self, x_mm):
        """Prescribe the axial coordinate of the plate, from the next solution on."""
        self.boundaries["plate"].update(x_mm - self.mesh.points[self.plate, 0])

    def solve(self, *items):
        """Find the equilibrium by the Newton method of felupe, and return the result.

        The result is in `field`, too. `fem.NewtonConvergenceError` is raised if no equilibrium is found.
        """
        dof0, dof1 = fem.dof.partition(self.field, self.boundaries)
        ext0 = fem.dof.apply(self.field, self.boundaries, dof0)
        result = fem.newtonraphson(
            items=[self.solid, self.gas, *items], x0=self.field, dof0=dof0, dof1=dof1, ext0=ext0,
            tol=TOLERANCE, maxiter=14, verbose=0,
        )  # fmt: skip
        self.field.link(result.x)
        return result


def _mesh(elements, layers):
    """Return the mesh, and the offset from the mid-surface in mm and the latitude of each point."""
    half_mm = THICKNESS_MM / 2
    mesh = fem.Rectangle(a=(-half_mm, 0), b=(half_mm, np.pi / 2), n=(layers + 1, elements + 1))
    offset_mm, latitude = mesh.points.T.copy()
    radius_mm = MID_RADIUS_MM + offset_mm
    axial, radial = np.sin(latitude), np.cos(latitude)
    radial[np.isclose(latitude, np.pi / 2)] = 0.0
    mesh.points[:] = np.column_stack([radius_mm * axial, radius_mm * radial])
    mesh.update(
        cells=mesh.cells[:, ::-1]
    )  # the axes (offset, latitude) and (x, r) have opposite orientations
    return mesh, offset_mm, latitude


def half_balloon(material, elements=ELEMENTS, layers=LAYERS):
    """Return a half balloon of a material at rest."""
    mesh, offset_mm, latitude = _mesh(elements, layers)
    surfaces = [np.flatnonzero(np.isclose(offset_mm, side * THICKNESS_MM / 2)) for side in (1, -1)]
    outer, inner = (points[np.argsort(latitude[points])] for points in surfaces)
    mesh.add_points([2 * MID_RADIUS_MM, 0.0])
    plate = mesh.npoints - 1
    field = fem.FieldContainer([fem.FieldAxisymmetric(fem.RegionQuad(mesh), dim=2)])
    inside = fem.RegionQuadBoundary(mesh, mask=np.isin(np.arange(mesh.npoints), inner), ensure_3d=True)
    gas = LockedGas(fem.FieldContainer([fem.FieldAxisymmetric(inside, dim=2)]), inner)
    axial_only, radial_only = (False, True), (True, False)
    boundaries = {
        "axis": fem.Boundary(field[0], mask=mesh.points[:, 1] == 0, skip=radial_only),
        "equator": fem.Boundary(field[0], mask=mesh.points[:, 0] == 0, skip=axial_only),
        "plate": fem.Boundary(field[0], mask=np.arange(mesh.npoints) == plate, skip=axial_only),
    }
    solid = fem.SolidBodyNearlyIncompressible(material, field, bulk=BULK_MODULUS_KPA)
    return Balloon(mesh, field, solid, gas, outer, inner, plate, boundaries)
