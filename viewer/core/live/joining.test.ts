import { expect, it, vi } from "vitest";
import { breakOff, LINK, liveServer, self } from "../../test/liveserver.ts";
import { Joining } from "./joining.ts";
import { Session } from "./session.ts";

const turn = () => new Promise((done) => setTimeout(done));

function joining(link: string | undefined) {
  const server = liveServer(link);
  const one = new Joining(() => Session.offered(server.parts), server.parts.clock);
  /** Lets frames run for so long. */
  const wait = async (seconds: number) => {
    for (let i = 0; i < seconds; i += 1) {
      server.clock.now_ms += 1000;
      one.update(self(0));
      await turn();
    }
  };
  const asked = () => server.sent.filter(({ method }) => method === "HEAD").length;
  return { server, one, wait, asked };
}

it.each([503, 0])("who comes while the server is away (%i) meets others once it is back", async (status) => {
  const { server, one, wait, asked } = joining(LINK);
  server.clock.pointerStatus = status;
  await wait(60);
  expect(one.meeting).toBe("away");
  expect(asked()).toBeGreaterThan(2);
  expect(asked()).toBeLessThan(7);
  server.clock.pointerStatus = 200;
  await wait(120);
  await vi.waitFor(() => expect(one.meeting).toBe("met"));
  expect(server.sent.filter(({ method }) => method === "POST").length).toBe(1);
  breakOff(server.streams[0]?.stream);
  expect(one.meeting).toBe("away");
});

it("who is told when to ask again does not ask before", async () => {
  const { server, one, wait, asked } = joining(LINK);
  Object.assign(server.clock, { pointerStatus: 503, retryAfter: "40" });
  await wait(43);
  expect([one.meeting, asked()]).toEqual(["away", 1]);
  await wait(5);
  expect(asked()).toBe(2);
});

it("the first question may wait behind first downloads as long as the opening", async () => {
  const timeouts = vi.spyOn(AbortSignal, "timeout");
  const { wait, asked } = joining(LINK);
  await wait(1);
  expect([asked(), timeouts.mock.calls]).toEqual([1, [[60_000]]]);
  timeouts.mockRestore();
});

it("a tree that has no sessions is asked once", async () => {
  const { one, wait, asked } = joining(undefined);
  await wait(60);
  expect([one.meeting, asked()]).toEqual(["never", 1]);
});

it("who comes back to a page that was left asks anew", async () => {
  const { server, one, wait, asked } = joining(LINK);
  await wait(3);
  one.leave();
  await wait(3);
  expect([one.meeting, asked()]).toEqual(["away", 1]);
  one.comeAgain();
  await wait(3);
  expect([one.meeting, asked()]).toEqual(["met", 2]);
  expect(server.sent.filter(({ method }) => method === "POST").length).toBe(2);
});
