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
    >>> round(overlap * 1e4, 4), round(force / 1e4, 4)
    (2.7411, 1.0697)
    """
    overlap = (15.0 * mass_eff * speed**2 / (16.0 * modulus_eff * np.sqrt(radius_eff))) ** 0.4
    return overlap, 4.0 / 3.0 * modulus_eff * np.sqrt(radius_eff) * overlap**1.5


def hertz_contact_time(speed, mass_eff, modulus_eff, radius_eff):
    """Duration of that impact: 2.943275 d_max / v, the number being 2 int_0^1 (1 - x^(5/2))^(-1/2) dx."""
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


# -- oblique impact that slides throughout: rigid-body impulse, Walton 1993; Chung & Ooi 2011, tests 4 to 8 -----------------------


def slides_throughout(tangential, normal, friction, restitution):
    """Whether the contact slides to its end: v_t / v_n > 3.5 mu (1 + e); spheres with I = 2/5 m R^2."""
    return tangential > 3.5 * friction * (1.0 + restitution) * normal


def sliding_impact(tangential, normal, friction, restitution, radius):
    """Tangential velocity of the centre, its ratio e_t, spin, and angle of the contact point's rebound [degrees] after it."""
    impulse = friction * (1.0 + restitution) * normal
    spin = 2.5 * impulse / radius
    angle = np.degrees(np.arctan2(tangential - 3.5 * impulse, restitution * normal))
    return tangential - impulse, 1.0 - impulse / tangential, spin, angle


# -- rolling and falling ------------------------------------------------------------------------------------------------------


def rolling_starts(speed, friction, gravity):
    """A sphere set sliding without spin on a level plane rolls from t = 2 u0 / (7 mu g) on, with u = 5/7 u0."""
    return 2.0 * speed / (7.0 * friction * gravity), 5.0 / 7.0 * speed


def rolling_acceleration(angle, gravity):
    """A sphere that rolls down an incline: 5/7 g sin(angle)."""
    return 5.0 / 7.0 * gravity * np.sin(angle)
