import { expect, it } from "vitest";
import { publish } from "../../test/fixture.ts";
import { serveFiles } from "../../test/serve.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../fetch/fetchqueue.ts";
import { Tree } from "../fetch/tree.ts";
import { webCryptoDigest } from "../fetch/verify.ts";
import { fetchSceneList, PublishedScene, StalePointerError } from "./published.ts";

const TREE = new Tree("https://host/sub/");
const SIGN_IN = "\n<!DOCTYPE html><title>Welcome to our hotel</title>";

/** A server whose first answers are those of somebody else. */
function behindHotel(pages: number) {
  const { fetch, requests } = serveFiles(publish({ rooms: 3 }));
  let left = pages;
  const answer = async (url: string, init?: RequestInit) => {
    const right = await fetch(url, init);
    left -= 1;
    return left >= 0 ? new Response(SIGN_IN) : right;
  };
  return { queue: new FetchQueue({ ...FETCH_DEFAULTS, fetch: answer, digest: webCryptoDigest() }), requests };
}

it("asks once more for a pointer or a list that cannot be read", async () => {
  const { queue, requests } = behindHotel(1);
  expect((await PublishedScene.open(queue, TREE, "rooms")).pointer.scene).toBe("rooms");
  expect(requests.slice(0, 2)).toEqual(Array(2).fill("/v1/scenes/rooms/index.json"));
  const listing = behindHotel(1);
  expect((await fetchSceneList(listing.queue, TREE)).length).toBe(1);
});

it("says what came instead when it comes again", async () => {
  const { queue, requests } = behindHotel(9);
  await expect(PublishedScene.open(queue, TREE, "rooms")).rejects.toThrow(
    "the pointer of rooms should be JSON, but it begins with “<!DOCTYPE html><title>Welcome to our hotel</title>”",
  );
  expect(requests.length).toBe(2);
});

const POINTER = "/v1/scenes/rooms/index.json";
const parsed = (bytes: Uint8Array | undefined) => JSON.parse(new TextDecoder().decode(bytes));

/** A tree that was published anew, behind a cache that holds the pointer of the revision before, for all who do not ask past it. */
function behindCache(isPassed: boolean) {
  const files = publish({ rooms: 3 });
  const now = parsed(files.get(POINTER));
  const gone = `/o/${"0".repeat(64)}.json`;
  const { fetch } = serveFiles(files);
  const asked: (RequestCache | undefined)[] = [];
  const answer = async (url: string, init?: RequestInit) => {
    if (!url.endsWith(POINTER)) return fetch(url, init);
    asked.push(init?.cache);
    if (isPassed && init?.cache === "reload") return fetch(url, init);
    return new Response(JSON.stringify({ ...now, revision: "0".repeat(16), manifest: gone }));
  };
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch: answer, digest: webCryptoDigest() });
  return { queue, asked, now, gone };
}

it("a pointer that names what is gone is read once more, past all caches", async () => {
  const { queue, asked, now } = behindCache(true);
  expect((await PublishedScene.open(queue, TREE, "rooms")).pointer.revision).toBe(now.revision);
  expect(asked).toEqual(["no-cache", "reload"]);
});

it("says why what a pointer names may be gone, as the client does", async () => {
  const { queue, asked, gone } = behindCache(false);
  const opening = PublishedScene.open(queue, TREE, "rooms");
  await expect(opening).rejects.toBeInstanceOf(StalePointerError);
  await expect(opening).rejects.toThrow(
    `the pointer of \`rooms\` names ${gone}, which is not there: a cache on the way holds an old pointer, or the tree was copied in part`,
  );
  expect(asked.length).toBe(2);
});
