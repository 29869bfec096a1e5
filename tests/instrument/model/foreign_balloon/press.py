"""Pressing of a balloon with locked gas by a rigid plate with friction, by the contact item of felupe."""

import felupe as fem
import numpy as np

#: Stiffness of the contact per point. At 3.5 N, the points penetrate the plate by less than 0.003 mm.
CONTACT_STIFFNESS_MN_PER_MM = 1e5
#: Largest elastic displacement of a point that sticks to the plate.
ELASTIC_SLIP_MM = 0.001
STEP_MM, MIN_STEP_MM = 0.04, 0.001


def press(
    balloon,
    friction,
    max_force_n,
    max_kpa,
    step_mm=STEP_MM,
    slip_mm=ELASTIC_SLIP_MM,
    stiffness_mn_per_mm=CONTACT_STIFFNESS_MN_PER_MM,
):
    """Press an inflated balloon with locked gas by a plate, step by step.

    Return a row per equilibrium: force in N, pressure in kPa, contact radius in mm, indentation in mm,
    volume of the pressed half in mm³. The last row is the first one above the maximum force. The path ends
    earlier if the pressure exceeds `max_kpa`, or if the Newton method finds no further equilibrium.
    """
    pole_mm = balloon.positions_mm(balloon.outer[-1])[0]
    balloon.field[0].values[balloon.plate, 0] = pole_mm - balloon.mesh.points[balloon.plate, 0] + MIN_STEP_MM
    contact = fem.ContactRigidPlane(
        balloon.field,
        points=balloon.outer,
        centerpoint=balloon.plate,
        normal=[-1.0, 0.0],
        friction=friction,
        multiplier=stiffness_mn_per_mm,
        elastic_slip=slip_mm if friction else None,
    )
    indentation_mm, step = 0.0, step_mm
    rows = [(0.0, balloon.gas.pressure_kpa, 0.0, 0.0, balloon.half_volume_mm3())]
    while rows[-1][0] <= max_force_n and step >= MIN_STEP_MM:
        before = balloon.displacements_mm(), contact.checkpoint()
        balloon.move_plate(pole_mm - indentation_mm - step)
        try:
            result = balloon.solve(contact)
        except fem.NewtonConvergenceError:
            balloon.restore(before[0])
            contact.restore(before[1])
            step /= 2
            continue
        if balloon.gas.pressure_kpa > max_kpa:
            break
        indentation_mm += step
        step = min(1.5 * step, step_mm)
        force_n = -result.fun.reshape(-1, 2)[balloon.plate, 0] / 1000
        radius_mm = contact_radius_mm(balloon.positions_mm(balloon.outer), contact.results.active)
        rows.append((force_n, balloon.gas.pressure_kpa, radius_mm, indentation_mm, balloon.half_volume_mm3()))
    return np.array(rows)


def contact_radius_mm(positions_mm, touching):
    """Return the radius at which the outer surface leaves the plate.

    Near the edge of the contact, the gap increases with the square of the distance from the edge. The root
    of the gap is therefore extrapolated to zero from the first two points that do not touch the plate.
    """
    if not touching.any():
        return 0.0
    first = int(np.flatnonzero(touching).min())
    plate_x_mm = positions_mm[touching, 0].mean()
    x_mm, r_mm = positions_mm[first - 2 : first].T
    far, near = np.sqrt(np.maximum(plate_x_mm - x_mm, 0.0))
    return r_mm[1] - near * (r_mm[0] - r_mm[1]) / (far - near)
