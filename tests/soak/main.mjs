/**
 * Does a server stay as it is under a long mixed load? `node tests/soak/main.mjs PROGRAM [MINUTES]` serves small worlds, reads
 * them in every way, lets people and things move about in them, and publishes, rolls back and clears others meanwhile. Each
 * answer is checked. Fails on any error, and when memory grows by more than 5 % after the first two minutes.
 */
import path from "node:path";
import { Living } from "./living.mjs";
import { LEAST_MIN, Memory, MOST_GROWTH } from "./memory.mjs";
import { Door, Moving } from "./moving.mjs";
import { Publishing } from "./publishing.mjs";
import { Reading } from "./reading.mjs";
import { report } from "./report.mjs";
import { LEASE_S, Server } from "./server.mjs";
import { insist, keepDoing, sleep, Tally } from "./tally.mjs";
import { Wire } from "./wire.mjs";

const READERS = 12;
const PEOPLE = 40;

const [program, minutesAsked] = process.argv.slice(2);
insist(program, "usage: node tests/soak/main.mjs PROGRAM [MINUTES]");
const minutes = Number(minutesAsked ?? 20);
insist(minutes >= LEAST_MIN, `a soak takes ${LEAST_MIN} minutes at least`);

const soak = { over: false, tally: new Tally() };
const { tally } = soak;
const server = await Server.start(path.resolve(program));
const memory = new Memory(server.pid);
const wire = new Wire(server.base, tally);

const gallery = await Reading.of(wire, "gallery");
const doored = await Reading.of(wire, "doored");
const inGallery = new Living(wire, "gallery", gallery.pointer.bounds, LEASE_S);
const byTheDoor = new Living(wire, "doored", doored.pointer.bounds, LEASE_S);
const moving = new Moving(inGallery);
const { objects } = await wire.json("query", `/v1/scenes/doored/objects?bbox=-9,-9,-9,99,9,99`);
const door = new Door(byTheDoor, objects.find((object) => object.door).object);
const publishing = await Publishing.with(wire, server);

const readers = Array.from({ length: READERS }, (_, i) => (i % 4 === 3 ? doored : gallery));
const people = Array.from({ length: PEOPLE }, (_, i) => (i % 4 === 3 ? byTheDoor : inGallery));
const work = [
  ...readers.map((reading) => keepDoing("reading", soak, () => reading.step())),
  ...people.map((living) => keepDoing("a visit", soak, () => living.visit(soak))),
  keepDoing("HTTP/2", soak, () => gallery.second()),
  keepDoing("movers", soak, () => moving.step()),
  keepDoing("the door", soak, () => door.step(soak)),
  keepDoing("publishing", soak, () => publishing.step()),
];

// Ended early, it says what there is to say.
for (const signal of ["SIGINT", "SIGTERM"]) {
  process.once(signal, () => {
    soak.over = true;
  });
}
const due = Date.now() + 60_000 * minutes;
while (Date.now() < due && !soak.over && !server.gone) await sleep(1000);
soak.over = true;
memory.stop();
await Promise.all(work);
const metrics = server.gone ? "" : (await wire.ask("metrics", "/metrics")).body.toString();
const ending = await server.stop();

const grown = report({ tally, memory, metrics, ending });
const failed = tally.wrongs > 0 || ending.code !== 0 || ending.errors.length > 0 || !(grown <= MOST_GROWTH);
process.exit(failed ? 1 : 0);
