"""Closed forms that the tests of this folder compare with, each with its source. Plain numbers and NumPy arrays; no barchan."""

import numpy as np

# -- contact of two elastic spheres: Hertz 1882; K. L. Johnson, Contact Mechanics, 1985, sections 4.2 and 11.4 -------------------


def effective(first, second):
    """Effective value 1 / (1/first + 1/second); an infinite partner drops out."""
    return 1.0 / (1.0 / first + 1.0 / second)


def effective_modulus(modulus_1, poisson_1, modulus_2, poisson_2):
    """E* of two materials: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    >>> round(effective_modulus(4.8e10, 0.2, 4.8e10, 0.2) / 1e10, 6)
    2.5
    """
    return 1.0 / ((1.0 - poisson_1**2) / modulus_1 + (1.0 - poisson_2**2) / modulus_2)


def hertz_peak(speed, mass_eff, modulus_eff, radius_eff):
    """Largest overlap and force of an elastic head-on impact: energy balance of F = 4/3 E* sqrt(R*) d^(3/2).

    >>> overlap, force = hertz_peak(20.0, 5.864306e-3, 2.5e10, 0.005)
    >>> print(f"{overlap:.4e} {force:.4e}")
    2.7411e-04 1.0697e+04
    """
    overlap = (15.0 * mass_eff * speed**2 / (16.0 * modulus_eff * np.sqrt(radius_eff))) ** 0.4
    return overlap, 4.0 / 3.0 * modulus_eff * np.sqrt(radius_eff) * overlap**1.5


def hertz_contact_time(speed, mass_eff, modulus_eff, radius_eff):
    """Duration of that impact: 2.943275 d_max / v, the number being 2 int_0^1 (1 - x^(5/2))^(-1/2) dx.

    >>> print(f"{hertz_contact_time(20.0, 5.864306e-3, 2.5e10, 0.005):.5e}")
    4.03395e-05
    """
    return 2.943275 * hertz_peak(speed, mass_eff, modulus_eff, radius_eff)[0] / speed


# -- spring and dashpot: Schwager & Poeschel, Granular Matter 9, 465 (2007) ----------------------------------------------------


def linear_contact_time(stiffness, mass_eff, rate=0.0):
    """Half a period of the damped spring, pi / sqrt(k/m - (rate/2)^2); ``rate`` is gamma_n [1/time]."""
    return np.pi / np.sqrt(stiffness / mass_eff - 0.25 * rate**2)


def linear_restitution(stiffness, mass_eff, rate):
    """exp(-rate t_c / 2) when the contact ends at zero overlap (the force may be tensile before)."""
    return np.exp(-0.5 * rate * linear_contact_time(stiffness, mass_eff, rate))


def leap_frog_contact_time(stiffness, mass_eff, dt):
    """The same for an undamped spring moved by the leap-frog: sin(W dt / 2) = w dt / 2 turns w into W (Hairer et al. 2003)."""
    return np.pi * dt / (2.0 * np.arcsin(0.5 * dt * np.sqrt(stiffness / mass_eff)))


# -- oblique impact that slides throughout: rigid-body impulse, Walton 1993; Chung & Ooi 2011, tests 4 to 8 ---------------------


def slides_throughout(tangential, normal, friction, restitution):
    """Whether the contact slides to its end: v_t / v_n > 3.5 mu (1 + e); spheres with I = 2/5 m R^2."""
    return tangential > 3.5 * friction * (1.0 + restitution) * normal


def sliding_impact(tangential, normal, friction, restitution, radius):
    """Tangential velocity of the centre, its ratio e_t, spin, and angle of the contact point's rebound [degrees] after it."""
    impulse = friction * (1.0 + restitution) * normal
    spin = 2.5 * impulse / radius
    angle = np.degrees(np.arctan2(tangential - 3.5 * impulse, restitution * normal))
    return tangential - impulse, 1.0 - impulse / tangential, spin, angle


def damping_ratio(restitution):
    """z of a dashpot whose contact force is never tensile: exp(-2 z acos(z) / sqrt(1 - z^2)) = e for z < 1, by bisection.

    Schwager & Poeschel 2007 for the spring; Hertz with Tsuji's dashpot has the same equation of motion in overlap^(5/4).

    >>> round(damping_ratio(0.5), 4)
    0.2553
    """
    low, high = 0.0, 1.0 - 1e-12
    for _ in range(80):
        z = 0.5 * (low + high)
        low, high = (z, high) if np.exp(-2.0 * z * np.arccos(z) / np.sqrt(1.0 - z * z)) > restitution else (low, z)
    return 0.5 * (low + high) if restitution < 1.0 else 0.0


def weighted_overlap(peak):
    """Mean overlap of an elastic Hertz impact, weighted with the force: d_max B(7/5, 1/2) / 2 = 0.8176 d_max.

    An arm to the plane of contact is shorter than R by that much on average, and so is the spin of a sliding impact.
    """
    return 0.817563 * peak


def mindlin_impact(normal, tangential, spin, radius, mass, modulus_eff, shear_eff, friction, restitution, share=1.0, steps=20000):
    """One oblique impact on an immobile body, by direct integration in the plane of the impact: the documented law of
    ``hertz_mindlin`` (Marketos et al. 2013, Tsuji et al. 1992), programmed a second time with the normal kept fixed.

    dF_s = -8 G* a v_slip dt; F_n = 4/3 E* a d + eta d' >= 0; eta = 2 sqrt(5/4) z sqrt(m 4/3 E* a); |F_s - eta v_slip| <= mu F_n;
    arm R - share d, with share = R_wall / (R + R_wall).

    Args:
        normal, tangential, spin: speed of approach, tangential velocity, and angular velocity about normal x tangent, (k,).

    Returns:
        (speed of rebound, tangential velocity, spin) after the contact, (k,) each.
    """
    v_n, v_t, w = (np.array(np.broadcast_to(x, np.shape(tangential)), dtype=float) for x in (normal, tangential, spin))
    alpha = np.sqrt(5.0) * damping_ratio(restitution)
    dt = hertz_contact_time(v_n.min(), mass, modulus_eff, radius * share) / steps
    inertia, overlap, shear = 0.4 * mass * radius**2, 1e-12 * radius * np.ones_like(v_n), np.zeros_like(v_n)
    for _ in range(2 * steps):
        touches = overlap > 0.0
        if not touches.any():
            return -v_n, v_t, w
        a, arm = np.sqrt(radius * share * np.maximum(overlap, 0.0)), radius - share * overlap
        stiffness, slip = 4.0 / 3.0 * modulus_eff * a, v_t - arm * w
        eta = alpha * np.sqrt(mass * stiffness)
        pressing = np.maximum(stiffness * overlap + eta * v_n, 0.0) * touches
        shear = shear - 8.0 * shear_eff * a * slip * dt
        force = np.clip(shear - eta * slip, -friction * pressing, friction * pressing)
        shear = force + eta * slip
        v_n, v_t, w = v_n - dt * pressing / mass, v_t + dt * force / mass, w - dt * arm * force / inertia
        overlap = overlap + dt * v_n
    raise AssertionError("a contact did not end")


# -- rolling and falling ------------------------------------------------------------------------------------------------------


def rolling_starts(speed, friction, gravity):
    """A sphere set sliding without spin on a level plane rolls from t = 2 u0 / (7 mu g) on, with u = 5/7 u0."""
    return 2.0 * speed / (7.0 * friction * gravity), 5.0 / 7.0 * speed


def rolling_acceleration(angle, gravity):
    """A sphere that rolls down an incline: 5/7 g sin(angle)."""
    return 5.0 / 7.0 * gravity * np.sin(angle)


def rolling_over_neck(angle, times, large, small, gravity):
    """Angle from the top at which a sphere that rolls without slip around the neck of two touching, immobile spheres stands.

    Energy of the rigid rolling sphere: rho K theta'' = g sin(theta), rho^2 = (R + r)^2 - R^2, K = 1 + 2/5 (R + r)^2 / rho^2
    (it turns with theta' (R + r) / r about the neck's axis). Integrated by small steps of the leap-frog.

    Args:
        angle: at rest at time 0 [radians].
        times: ascending.
    """
    reach = np.sqrt((large + small) ** 2 - large**2)
    rate = gravity / (reach * (1.0 + 0.4 * ((large + small) / reach) ** 2))
    steps = 20000
    dt, theta, path = times[-1] / steps, angle, [angle]
    velocity = -0.5 * dt * rate * np.sin(angle)
    for _ in range(steps):
        velocity += dt * rate * np.sin(theta)
        theta += dt * velocity
        path.append(theta)
    return np.interp(times, dt * np.arange(steps + 1), path)
