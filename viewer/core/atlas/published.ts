/**
 * How are the documents of one revision read? Fetches pages, chunks and records through the queue, decodes each once and
 * keeps the recently used ones.
 */
import { DocumentError, Json } from "../basics/json.ts";
import { type DecodedRecord, decodeCellRecord, decodeSteps, type Steps } from "../documents/cellrecord.ts";
import {
  type CellEntry,
  type FileRef,
  type Manifest,
  type ObjectEntry,
  type Page,
  type PageEntry,
  type Pointer,
  readCellChunk,
  readManifest,
  readObjectChunk,
  readPage,
  readPointer,
  readSceneList,
  readStart,
  type SceneSummary,
  type Start,
} from "../documents/documents.ts";
import { type Model, readModelChunk } from "../documents/modeldocument.ts";
import { decodePopulation, type Member } from "../documents/population.ts";
import type { Freshness } from "../fetch/download.ts";
import type { FetchQueue } from "../fetch/fetchqueue.ts";
import { FetchError } from "../fetch/transfer.ts";
import type { Tree } from "../fetch/tree.ts";
import type { FrameBudget } from "../pace/framebudget.ts";
import { atOnce, type Pieces } from "../pace/pieces.ts";
import { PRIORITY } from "../strategy/priority.ts";

/** Documents kept after use, so that a walk to and fro decodes nothing twice. */
const KEPT_DOCUMENTS = 512;

/** The scenes of a tree, by name. */
export async function fetchSceneList(queue: FetchQueue, tree: Tree): Promise<SceneSummary[]> {
  return readNamed(queue, tree.sceneList(), "the list of scenes", readSceneList);
}

/** What the pointer of a scene names is gone, also past all caches that can be passed. */
export class StalePointerError extends Error {
  override readonly name = "StalePointerError";

  constructor(scene: string, path: string, cause: unknown) {
    super(
      `the pointer of \`${scene}\` names ${path}, which is not there: a cache on the way holds an old pointer, or the tree was copied in part`,
      { cause },
    );
  }
}

/**
 * A document that has a name instead of a hash. What cannot be read may be a damaged copy, or come from somebody on the way who
 * answers for the server, such as the page where one signs in to a network: so it is asked for once more.
 */
async function readNamed<T>(
  queue: FetchQueue,
  url: string,
  reason: string,
  read: (json: Json) => T,
  fresh: Freshness = "checked",
): Promise<T> {
  const ask = async (how: Freshness) =>
    read(jsonOf(await queue.request(url, PRIORITY.document, { fresh: how, reason }), reason));
  try {
    return await ask(fresh);
  } catch (error) {
    if (!(error instanceof DocumentError)) throw error;
    return ask("past caches");
  }
}

/** The pointer of a scene as the server has it, past all caches. */
function pointerAnew(queue: FetchQueue, tree: Tree, scene: string): Promise<Pointer> {
  const reason = `the pointer of ${scene}, since something is missing`;
  return readNamed(queue, tree.pointer(scene), reason, readPointer, "past caches");
}

/** One immutable revision of a scene. */
export class PublishedScene {
  private readonly kept = new Map<string, Promise<unknown>>();
  private budget: FrameBudget | undefined;

  private constructor(
    readonly queue: FetchQueue,
    readonly tree: Tree,
    readonly pointer: Pointer,
    readonly manifest: Manifest,
  ) {}

  static async open(queue: FetchQueue, tree: Tree, scene: string): Promise<PublishedScene> {
    const reason = `the manifest of ${scene}`;
    const manifestOf = ({ manifest }: Pointer) =>
      queue.request(tree.resolve(manifest), PRIORITY.document, { reason }).catch((error) => {
        throw error instanceof FetchError && error.isGone ? new StalePointerError(scene, manifest, error) : error;
      });
    let pointer = await readNamed(queue, tree.pointer(scene), `the pointer of ${scene}`, readPointer);
    const bytes = await manifestOf(pointer).catch(async (error) => {
      if (!(error instanceof StalePointerError)) throw error;
      // The pointer may have been older than what was cleaned up since, as a copy in a cache is.
      const newer = await pointerAnew(queue, tree, scene);
      if (newer.manifest === pointer.manifest) throw error;
      pointer = newer;
      return manifestOf(newer);
    });
    return new PublishedScene(queue, tree, pointer, readManifest(jsonOf(bytes, reason)));
  }

  /** What the pointer of the scene says now, as the server has it. */
  latest(): Promise<Pointer> {
    return pointerAnew(this.queue, this.tree, this.pointer.scene);
  }

  /** From now on files are asked for, and documents decoded, when a frame has time for it, before anything else that waits for that. */
  workWithin(budget: FrameBudget): void {
    this.budget = budget;
    this.queue.beginWithin(budget);
  }

  /** Decodes something as soon as may be. */
  decode<T>(work: () => T): Promise<T> {
    return this.budget?.run(work, "urgent") ?? Promise.resolve().then(work);
  }

  /** The same, in pieces. */
  decodePieces<T>(work: Pieces<T>): Promise<T> {
    return this.budget?.runPieces(work) ?? this.decode(() => atOnce(work));
  }

  page(file: FileRef, priority: number): Promise<Page> {
    return this.document(file, priority, "a page of an index", (bytes) =>
      readPage(jsonOf(bytes, `the index page ${file.url}`)),
    );
  }

  cellChunk(file: FileRef, priority: number): Promise<CellEntry[]> {
    return this.document(file, priority, "which cells there are", (bytes) =>
      readCellChunk(jsonOf(bytes, `the cell chunk ${file.url}`)),
    );
  }

  objectChunk(file: FileRef, priority: number): Promise<ObjectEntry[]> {
    return this.document(file, priority, "where objects are", (bytes) =>
      readObjectChunk(jsonOf(bytes, `the object chunk ${file.url}`)),
    );
  }

  modelChunk(file: FileRef, priority: number): Promise<ReadonlyMap<number, Model>> {
    return this.document(file, priority, "what objects are", (bytes) =>
      readModelChunk(jsonOf(bytes, `the model chunk ${file.url}`)),
    );
  }

  start(file: FileRef, priority: number): Promise<Start> {
    return this.document(file, priority, "all that can be seen first", (bytes) =>
      readStart(jsonOf(bytes, `the start ${file.url}`)),
    );
  }

  population(entry: PageEntry, priority: number): Promise<readonly Member[]> {
    return this.document(entry, priority, "which grown models stand where", (bytes) =>
      decodePopulation(bytes, entry, `the population ${entry.url}`),
    );
  }

  record(entry: CellEntry, priority: number): Promise<DecodedRecord> {
    const file = { url: entry.record, bytes: entry.recordBytes };
    return this.documentInPieces(file, priority, `what c${entry.cell} sees`, function* (bytes) {
      const decoded = yield* decodeCellRecord(new Uint8Array(bytes));
      const { cell } = decoded.record;
      if (cell !== entry.cell) throw new Error(`the record of c${entry.cell} is one of c${cell}`);
      return decoded;
    });
  }

  /** What changes on the way from a cell to its neighbours, or `undefined` when it has none. */
  async steps(entry: CellEntry, priority: number): Promise<Steps | undefined> {
    if (!entry.steps) return undefined;
    return this.document(entry.steps, priority, `what the neighbours of c${entry.cell} see`, (bytes) => {
      const steps = decodeSteps(new Uint8Array(bytes));
      if (steps.from !== entry.cell) throw new Error(`the steps from c${entry.cell} are those from c${steps.from}`);
      return steps;
    });
  }

  private document<T>(file: FileRef, priority: number, reason: string, decode: (bytes: ArrayBuffer) => T): Promise<T> {
    // biome-ignore lint/correctness/useYield: it is short.
    return this.documentInPieces(file, priority, reason, function* (bytes) {
      return decode(bytes);
    });
  }

  /** Fetches and decodes once; a failure is forgotten, so that asking again tries again. */
  private documentInPieces<T>(
    { url, bytes }: FileRef,
    priority: number,
    reason: string,
    decode: (bytes: ArrayBuffer) => Pieces<T>,
  ): Promise<T> {
    const known = this.kept.get(url) as Promise<T> | undefined;
    const address = this.tree.resolve(url);
    if (known) {
      this.kept.delete(url);
      this.kept.set(url, known);
      this.queue.hasten(address, priority);
      return known;
    }
    const reading = this.queue
      .request(address, priority, { reason, bytes })
      .then((come) => this.decodePieces(decode(come)));
    this.kept.set(url, reading);
    reading.catch(() => this.kept.delete(url));
    for (const oldest of this.kept.keys()) {
      if (this.kept.size <= KEPT_DOCUMENTS) break;
      this.kept.delete(oldest);
    }
    return reading;
  }
}

function jsonOf(bytes: ArrayBuffer, place: string): Json {
  return Json.parse(new TextDecoder().decode(bytes), place);
}
