import { expect, it } from "vitest";
import { publish } from "../../test/fixture.ts";
import { serveFiles } from "../../test/serve.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../fetch/fetchqueue.ts";
import { Tree } from "../fetch/tree.ts";
import { webCryptoDigest } from "../fetch/verify.ts";
import { fetchSceneList, PublishedScene } from "./published.ts";

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
