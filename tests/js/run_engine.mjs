// Runs and statics of the page's engine for cases on standard input; arrays of doubles travel as base64.
import { readFileSync } from "node:fs";

const { Pose, machine, polygon, rest, simulate } = await import(process.env.RAPKM_ENGINE);

const packed = (array) => Buffer.from(array.buffer).toString("base64");
const answers = JSON.parse(readFileSync(0, "utf8")).map(({ robot, corners, points, ...how }) => {
  const m = machine(robot);
  if (points) {
    return points.map(([x, y]) => {
      const pose = new Pose(m);
      if (!pose.at(x, y)) return null;
      const settled = rest(m, x, y, how.K_P, how.offset);
      return {
        angle: how.offset.map((_, i) => pose.angle(i)), A: Array.from(pose.bx, (bx, i) => [bx, pose.by[i]]),
        null: m.N === 3 ? pose.nullVector() : null, polygon: pose.forcePolygon(0.1),
        moving: pose.filter([...how.offset]), rest: [settled.pose.x, settled.pose.y], torque: settled.torque,
      };
    });
  }
  const path = polygon(m, corners, how), run = simulate(m, path, how);
  return { lost: run.lost, ...Object.fromEntries(["x", "angle", "torque", "energy"].map((k) => [k, packed(run[k])])) };
});
console.log(JSON.stringify(answers));
