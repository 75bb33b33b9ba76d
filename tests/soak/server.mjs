/** Where is the server that is looked at? Bakes two small worlds into a folder of its own and serves them. */
import { execFile, spawn } from "node:child_process";
import { createWriteStream } from "node:fs";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";
import { promisify } from "node:util";
import { insist } from "./tally.mjs";

const run = promisify(execFile);
const root = path.resolve(import.meta.dirname, "../..");

export const LEASE_S = 10;
/** Less than the worlds take, so that memory for blobs is full from the start. */
const CACHE_MIB = 2;

export class Server {
  #program;
  #data;
  #log;
  #process;
  #ended;

  static async start(program) {
    const server = new Server();
    server.#program = program;
    server.#data = await mkdtemp(path.join(tmpdir(), "belvedere-soak-"));
    server.#log = path.join(server.#data, "serve.log");
    await server.ask("bake", path.join(root, "content/gallery.dcg"), "--scene", "gallery");
    await server.ask("bake", path.join(root, "viewer/e2e/worlds/doored.dcg"), "--scene", "doored");
    await server.#serve();
    return server;
  }

  async #serve() {
    const settings = ["--lease-s", LEASE_S, "--cache-mib", CACHE_MIB, "--data", this.#data].map(String);
    const listen = process.env.BELVEDERE_LISTEN ?? "127.0.0.1:0";
    this.#process = spawn(this.#program, ["serve", "--listen", listen, ...settings], {
      stdio: ["ignore", "pipe", "pipe"],
    });
    this.#ended = new Promise((ended) => this.#process.once("exit", (code, signal) => ended(code ?? signal)));
    this.#process.stderr.pipe(createWriteStream(this.#log));
    const address = new Promise((found) => {
      this.#process.stdout.on("data", (said) => found(/http:\/\/[\d.:]+/.exec(said)?.[0]));
    });
    this.base = await Promise.race([address, this.#ended.then(() => undefined)]);
    insist(this.base, `the server did not start: ${await readFile(this.#log, "utf8")}`);
  }

  get pid() {
    return this.#process.pid;
  }

  /** Whether it has ended by itself. */
  get gone() {
    return this.#process.exitCode !== null || this.#process.signalCode !== null;
  }

  /** What a command on the same data says. */
  async ask(...words) {
    return (await run(this.#program, [...words, "--data", this.#data])).stdout;
  }

  /** Ends it; what it ended with, and the lines of its log that warn or tell of errors. */
  async stop() {
    this.#process.kill("SIGTERM");
    const code = await this.#ended;
    const log = await readFile(this.#log, "utf8");
    await rm(this.#data, { recursive: true });
    const lines = (pattern) => log.split("\n").filter((line) => pattern.test(line));
    return { code, warnings: lines(/ WARN /), errors: lines(/ ERROR |panicked/) };
  }
}
