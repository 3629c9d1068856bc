"""More than two bodies at a place: a stack, thin plates of which several are in a cell, a tool on two bodies,
a body over the joint of two others. The cells are 1 m."""

from meeting import *


def stack(name, heights, domain="fixed", offset=0.0, wide=1, steps=3000):
    """A column of blocks between symmetry sides, each a contact group, on a rigid tool, under gravity: loads
    over weights."""
    total = sum(heights)
    pull, swing, end = (
        1e-3 * YOUNG / (DENSITY * total),
        math.pi * BAR_WAVE / (2 * total),
        steps * 0.3 / BAR_WAVE,
    )
    levels = offset + np.concatenate([[0], np.cumsum(heights)])
    bodies = "".join(
        f"&body material='m', shape='box', lower=0,0,{float(low)!r}, upper={wide},{wide},{float(high)!r} "
        f"{group(f'g{n}')} /\n"
        for n, (low, high) in enumerate(zip(levels, levels[1:]))
    )
    run = Run(
        name,
        f"""&scene title='stack', end_time={end!r} /
&grid lower=0,0,-2, upper={wide},{wide},{math.ceil(total) + 3}, cell_size=1, boundary='symmetry','symmetry','symmetry','symmetry','free','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0 /
{bodies}&tool name='base', shape='flat', radius=10, tip=0,0,{offset!r}, axis=0,0,1, times=0, speeds=0, penetration_factor=0.5 /
&gravity acceleration=0,0,{-pull!r} /
&damping kind='viscous', coefficient={2 * swing!r} /
&output directory='OUT', formats='none' /
""",
    )
    shares = []
    for n in range(len(heights) - 1):
        weight = DENSITY * pull * wide**2 * sum(heights[n + 1 :])
        shares.append(-run.force(f"g{n}", f"g{n + 1}")[1][-1, 2] / weight)
    shares.append(run.history("tool_base")["load_z"][-1] / (DENSITY * pull * wide**2 * total))
    shares[-1] = abs(shares[-1])
    print(
        f"   {name}: loads over weights - 1: {', '.join(f'{share - 1:.1e}' for share in shares)}", flush=True
    )
    check(f"{name}: loads over weights, off 1", np.array(shares) - 1, 1e-5)


def tool_on_two(name, domain="fixed", steps=6000):
    """A rigid flat tool presses two blocks side by side, one twice as stiff, free to slide on each other,
    each confined: each carries its own uniaxial stress, E ln(1 - strain)."""
    end, pressed = steps * 0.2 / BAR_WAVE, 0.1
    speed, swing = pressed / (0.4 * end), math.pi * BAR_WAVE / 8
    run = Run(
        name,
        f"""&scene title='a tool on two bodies', end_time={end!r} /
&grid lower=0,0,0, upper=5,2,7, cell_size=1, boundary='symmetry','symmetry','symmetry','symmetry','symmetry','free' /
&time domain='{domain}' /
&material name='soft', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0 /
&material name='stiff', model='elastic', density={DENSITY}, young={2 * YOUNG}, poisson=0 /
&body material='soft', shape='box', lower=0,0,0, upper=2.5,2,4 {group('one')} /
&body material='stiff', shape='box', lower=2.5,0,0, upper=5,2,4 {group('two')} /
&tool name='flat', shape='flat', radius=30, tip=0,0,4, axis=0,0,-1, times=0,{0.4 * end!r},{0.4 * end * 1.001!r}, speeds={speed!r},{speed!r},0,
      penetration_factor=0.5 /
&damping kind='viscous', coefficient={2 * swing!r} /
&output directory='OUT' /
""",
    )
    rows = run.history("tool_flat")
    stretch = math.log(1 - rows["depth"][-1] / 4)
    load = rows["load_z"][-1] / (-YOUNG * stretch * 5 * 3)
    last = run.last()
    stress = last["stress"][:, 2] / (YOUNG * stretch)
    soft = last["position"][:, 0] < 2.5
    print(
        f"   {name}: load over the exact {load:.4f}; stress of the soft block {stress[soft].min():.3f} to "
        f"{stress[soft].max():.3f}, of the "
        f"stiff one {stress[~soft].min() / 2:.3f} to {stress[~soft].max() / 2:.3f}"
    )
    check(f"{name}: load over the exact, off 1", load - 1, 0.005)


def over_a_joint(name, domain="fixed", friction=0.3, height=2.0, steps=3000):
    """A block over the joint of two others, all free to part, on a rigid tool: the two carry its weight, half
    each, and stay."""
    pull, swing, end = 2e-4 * YOUNG / (DENSITY * 5), math.pi * BAR_WAVE / 10, steps * 0.3 / BAR_WAVE
    run = Run(
        name,
        f"""&scene title='over a joint', end_time={end!r} /
&grid lower=0,0,-2, upper=20,3,9, cell_size=1, boundary='free','free','symmetry','symmetry','free','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0.3 /
&body material='m', shape='box', lower=3.3,0,0.2, upper=9.8,3,{0.2 + height!r} {group('left')} /
&body material='m', shape='box', lower=9.8,0,0.2, upper=16.3,3,{0.2 + height!r} {group('right')} /
&body material='m', shape='box', lower=6.8,0,{0.2 + height!r}, upper=12.8,3,{3.2 + height!r} {group('top')} /
&body_contact friction={friction!r} /
&tool name='base', shape='flat', radius=40, tip=10,1,0.2, axis=0,0,1, times=0, speeds=0, penetration_factor=0.5, friction={friction!r} /
&gravity acceleration=0,0,{-pull!r} /
&damping kind='viscous', coefficient={swing!r} /
&output directory='OUT' /
""",
    )
    weight = DENSITY * pull * 6 * 3 * 3
    loads = np.array([-run.force(side, "top")[1][-1, 2] / weight for side in ("left", "right")])
    print(f"   {name}: shares of the weight {loads[0]:.5f} and {loads[1]:.5f}")
    check(f"{name}: sum of the two over the weight, off 1", loads.sum() - 1, 1e-4)
    check(f"{name}: halves", loads - 0.5, 0.05)  # friction leaves it open


CASES = {
    "stack": lambda: stack("stack", (4.0, 3.0, 2.0), steps=2500),
    "stack_long": lambda: [
        stack(f"stack_{heights}_{domain}_{offset}", heights, domain, offset)
        for heights in ((4.0, 3.0, 2.0), (3.0, 1.0, 1.0, 2.0), (3.0, 0.5, 0.5, 2.0))
        for domain in ("fixed", "corners")
        for offset in (0.0, 0.3)
        if min(heights) > 0.5 or domain == "corners"
    ],
    "tool_on_two": lambda: tool_on_two("tool_on_two", steps=3000),
    "tool_on_two_corners": lambda: tool_on_two("tool_on_two_corners", "corners"),
    "over_a_joint": lambda: over_a_joint("over_a_joint", steps=1500),
    "over_a_joint_long": lambda: [
        over_a_joint(f"over_a_joint_{domain}_{height}", domain, height=height)
        for domain in ("fixed", "corners")
        # cubes in plates of one layer do not come to rest
        for height in (2.0, 1.0)
    ],
}
if __name__ == "__main__":
    main(CASES)
