"""An arm of your own: its Denavit-Hartenberg table and its collision bodies, two files beside the scan."""

from pathlib import Path

import planner
from planner.cell.bodies import shipped_bodies
from planner.kinematics.arm import shipped_arms

print(f"shipped arms: {', '.join(shipped_arms())}; bodies: {', '.join(shipped_bodies())}")
package = Path(planner.__file__).parent

# Begin with copies of a shipped arm. Here the forearm (d_mm of joint 4) and its limits become another arm's.
arm = (package / "arms" / "viper_s650.toml").read_text(encoding="utf-8")
arm = arm.replace('name = "Adept Viper s650"', 'name = "mine"').replace("d_mm = 295", "d_mm = 350")
Path("mine.toml").write_text(arm, encoding="utf-8")
# The capsules must be those of the new arm: measure them. The longer forearm needs a longer capsule.
bodies = (package / "bodies" / "viper_s650.toml").read_text(encoding="utf-8")
Path("mine_bodies.toml").write_text(bodies, encoding="utf-8")

scan = (package / "scans" / "cylinder.toml").read_text(encoding="utf-8")
scan = scan.replace('arm = "viper_s650"', 'arm = "mine.toml"\nbodies = "mine_bodies.toml"')
Path("own_arm.toml").write_text(scan, encoding="utf-8")

slot = planner.Configuration.LEFTY_ABOVE_NOFLIP
for name in ("cylinder", "own_arm.toml"):
    loaded = planner.load_scan(name)
    share = planner.build_maps(loaded, [slot], angle_count=90)[slot].allowed.mean()
    print(f"{loaded.cell.arm.name:16} {share:6.1%} of the cells allowed")
