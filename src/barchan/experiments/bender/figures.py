"""Pictures of waves, from the tables and frames of their run."""

import numpy as np

from barchan.experiments.bender.arrival import METHODS, spectra
from barchan.experiments.bender.pictures import wave_pictures
from barchan.experiments.bender.results import peak
from barchan.experiments.bender.wave import waves
from barchan.view.style import COLOURS, figure

#: Largest number of receivers whose signals are drawn, and frequencies of a spectrum, over that of the pulse.
MOST, SPECTRUM = 24, np.linspace(0.02, 3.0, 150)

_MARKS = ("v", "^", "o", "s")


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, heard = directory / "figures", [wave for wave in waves(scene, directory) if wave.heard.sum() >= 3]
    picture = wave_pictures(scene, directory, out / "wave.png")
    if picture is not None:
        yield picture
    if not heard:
        return
    first = heard[:2]
    yield received(scene, first, out / "received.png")
    yield distances(scene, first, out / "time_distance.png")
    yield arrival(first, out / "arrivals.png")
    yield spectrum(scene, heard, out / "spectrum.png")


def received(scene, heard, path):
    """The pulse that was sent, and what the last receiver hears that hears all of the wave, as the paper's Figure 9."""
    with figure(path, len(heard), 1, size=(8.0, 2.4 * len(heard)), squeeze=False) as (_, axes):
        for axis, wave in zip(axes[:, 0], heard):
            number = np.flatnonzero(wave.heard)[-1]
            signal, time = wave.velocity[number], 1e6 * wave.time
            sent = scene.pulse(wave.shot.frequency, wave.time)
            axis.plot(time, sent / scene.pulse_stress, color=COLOURS[6], linewidth=1.0, label="sent, stress")
            label = f"received at {wave.distance[number] / scene.diameter:.1f} d, velocity"
            axis.plot(time, signal / np.abs(wave.clean[-1]).max(), color=COLOURS[0], label=label)
            for row, (method, when) in enumerate(zip(METHODS, wave.arrivals[-1])):
                place = [1e6 * when], [-1.2 - 0.16 * row]
                axis.plot(*place, _MARKS[row], color=COLOURS[1 + row], markersize=4, label=f"arrival, {method}")
            axis.axvline(1e6 * wave.limit[number], color=COLOURS[6], linewidth=0.8, linestyle=":")
            axis.set_title(wave.shot.name, loc="left", fontsize=9)
            axis.set(ylabel="over the largest", ylim=(-1.85, 1.15), yticks=(-1.0, -0.5, 0.0, 0.5, 1.0))
            axis.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes[-1, 0].set_xlabel("time since the pulse began [µs]")
    return path


def distances(scene, heard, path):
    """Signals of receivers against time, each at its distance, and when the wave peaks there."""
    with figure(path, 1, len(heard), size=(4.0 * len(heard), 4.2), sharey=True, squeeze=False) as (_, axes):
        for letter, axis, wave in zip("ab", axes[0], heard):
            distance = wave.distance / scene.diameter
            shown = np.arange(0, len(distance), -(-len(distance) // MOST))
            size = 1.3 * np.diff(distance[shown]).mean() / peak(wave)
            for number in shown[::-1]:
                before = wave.time <= wave.limit[number]
                axis.plot(1e6 * wave.time, distance[number] + size * wave.velocity[number], color="0.7", linewidth=0.8)
                line = distance[number] + size * wave.velocity[number, before]
                axis.plot(1e6 * wave.time[before], line, color=COLOURS[0], linewidth=0.9)
            line = wave.lines["peak to peak"]
            peaks = 1e6 * (wave.arrivals[:, 1] + 0.25 / wave.shot.frequency)
            axis.plot(peaks, distance[wave.heard], "o", color=COLOURS[1], markersize=3, label="peak")
            if line is not None:
                ends = np.array((0.0, distance[wave.heard][-1]))
                time = line.start + ends * scene.diameter / line.speed + 0.25 / wave.shot.frequency
                axis.plot(1e6 * time, ends, color=COLOURS[1], linewidth=0.9, label=f"{line.speed:.0f} m/s")
            axis.set_title(f"({letter})  {wave.shot.name}", loc="left", fontsize=9)
            axis.set(xlabel="time since the pulse began [µs]", xlim=(0.0, 1e6 * wave.time[-1]))
            axis.legend(loc="lower right")
        axes[0, 0].set_ylabel("distance [mean diameters]")
    return path


def arrival(heard, path):
    """Travel times against distance by each method, with their lines."""
    with figure(path, 1, len(heard), size=(4.0 * len(heard), 3.6), squeeze=False) as (_, axes):
        for axis, wave in zip(axes[0], heard):
            distance = 1e3 * wave.distance[wave.heard]
            for times, (method, line), colour, mark in zip(wave.arrivals.T, wave.lines.items(), COLOURS, _MARKS):
                label = method if line is None else f"{method}, {line.speed:.0f} m/s"
                axis.plot(distance, 1e6 * times, mark, color=colour, markersize=3.5, label=label)
                if line is not None:
                    axis.plot(distance, 1e6 * (line.start + 1e-3 * distance / line.speed), color=colour, linewidth=0.8)
            axis.set_title(wave.shot.name, loc="left", fontsize=9)
            axis.set(xlabel="distance [mm]", ylabel="travel time [µs]", xlim=(0.0, None), ylim=(0.0, None))
            axis.legend(fontsize=7)
    return path


def spectrum(scene, heard, path):
    """Amplitudes of what was sent and heard, and the speed of the phase against frequency."""
    with figure(path, 1, 2, size=(8.0, 3.6)) as (_, (left, right)):
        for wave, colour in zip(heard[:2], COLOURS):
            frequencies = SPECTRUM * wave.shot.frequency
            sent = np.abs(spectra(wave.time, scene.pulse(wave.shot.frequency, wave.time)[None], frequencies))[0]
            ends = np.abs(spectra(wave.time, wave.clean[[0, -1]], frequencies))
            top = ends[0].max()
            left.plot(1e-3 * frequencies, sent / sent.max(), color=colour, linewidth=0.8, linestyle=":")
            for amplitude, style, place in zip(ends, ("--", "-"), wave.distance[wave.heard][[0, -1]]):
                label = f"{wave.shot.kind}, {place / scene.diameter:.0f} d"
                left.plot(1e-3 * frequencies, amplitude / top, style, color=colour, label=label)
        for number, wave in enumerate(heard):
            colour, frequencies = COLOURS["PS".index(wave.shot.kind)], wave.band
            name = f"{wave.shot.kind}, measured" if number < 2 else None
            right.plot(1e-3 * frequencies, wave.phases(frequencies), color=colour, label=name)
            right.plot([1e-3 * wave.shot.frequency], [wave.speed], "o", color=colour, markersize=4)
        for wave in heard[:2]:
            theory = "crystal, long waves" if scene.packing == "fcc" else "if grains moved with the sample"
            colour = COLOURS["PS".index(wave.shot.kind)]
            right.axhline(wave.theory, color=colour, linewidth=0.8, linestyle="--", label=f"{wave.shot.kind}, {theory}")
        left.set(xlabel="frequency [kHz]", ylabel="amplitude over the largest (dotted: sent)", ylim=(0.0, None))
        right.set(xlabel="frequency [kHz]", ylabel="speed of the phase [m/s]", ylim=(0.0, None))
        left.legend(fontsize=8)
        right.legend(fontsize=7)
    return path
