import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { Camera, FIRST_PAUSE, fresh, LONGEST_PAUSE, PATIENCE, PERIOD, RENEWAL, type Picture, type Screen, type Sight } from "../src/pages/live/camera.ts";

/** Takes the place of the page: it counts requests, and the test decides when a picture arrives. */
class Page implements Screen {
  readonly asked: string[] = [];
  readonly sights: Sight[] = [];
  shown = false;
  kept = 0;
  readonly still = { width: 0, height: 0, getContext: () => ({ drawImage: () => (this.kept += 1) }) } as unknown as HTMLCanvasElement;
  readonly picture: Picture;
  private address = "";

  constructor() {
    const page = this;
    this.picture = {
      onload: null,
      onerror: null,
      naturalWidth: 640,
      naturalHeight: 480,
      get src() {
        return page.address;
      },
      set src(url: string) {
        page.address = url;
        page.asked.push(url);
      },
      removeAttribute: () => (page.address = ""),
    };
  }

  get open(): boolean {
    return this.address !== "";
  }

  reveal(shown: boolean): void {
    this.shown = shown;
  }

  told(sight: Sight): void {
    this.sights.push(sight);
  }

  arrive(): void {
    this.picture.onload?.call(this.picture as HTMLImageElement, new Event("load"));
  }
}

const url = "http://camera/pictures";
let page: Page;
const cameraOf = (kind: "stream" | "snapshot") => new Camera({ url, kind }, page);

beforeEach(() => {
  vi.useFakeTimers();
  page = new Page();
});
afterEach(() => vi.useRealTimers());

it("asks for each picture by an address that no cache knows", () => {
  expect(fresh("http://camera/a", 7)).toBe("http://camera/a?_=7");
  expect(fresh("http://camera/a?size=2", 7)).toBe("http://camera/a?size=2&_=7");
  const camera = cameraOf("snapshot");
  camera.start();
  page.arrive();
  vi.advanceTimersByTime(PERIOD);
  expect(new Set(page.asked).size).toBe(2);
});

it("asks for the next snapshot after the answer, and not sooner than the period", () => {
  cameraOf("snapshot").start();
  vi.advanceTimersByTime(3 * PERIOD);
  expect(page.asked).toHaveLength(1);
  page.arrive();
  expect([page.kept, page.sights.at(-1)]).toEqual([1, "live"]);
  vi.advanceTimersByTime(1);
  expect(page.asked).toHaveLength(2);
  page.arrive();
  vi.advanceTimersByTime(PERIOD - 2);
  expect(page.asked).toHaveLength(2);
  vi.advanceTimersByTime(2);
  expect(page.asked).toHaveLength(3);
});

it("asks a camera that does not answer ever less often, and forgets that after an answer", () => {
  cameraOf("snapshot").start();
  const waits: number[] = [];
  for (let i = 0; i < 8; i++) {
    vi.advanceTimersByTime(PATIENCE);
    expect([page.open, page.sights.at(-1)]).toEqual([false, "silent"]);
    const began = Date.now();
    while (!page.open) vi.advanceTimersByTime(100);
    waits.push(Date.now() - began);
  }
  expect(waits.slice(0, 3)).toEqual([FIRST_PAUSE, 2 * FIRST_PAUSE, 4 * FIRST_PAUSE]);
  expect(waits.at(-1)).toBe(LONGEST_PAUSE);
  page.arrive();
  vi.advanceTimersByTime(PERIOD + PATIENCE + FIRST_PAUSE);
  expect(page.open).toBe(true);
});

it("renews a stream, and keeps its last picture meanwhile", () => {
  cameraOf("stream").start();
  page.arrive();
  page.arrive(); // some browsers report each picture
  expect([page.shown, page.kept]).toEqual([true, 0]);
  vi.advanceTimersByTime(RENEWAL);
  expect([page.asked.length, page.shown, page.kept, page.sights.at(-1)]).toEqual([2, false, 1, "live"]);
  vi.advanceTimersByTime(PATIENCE);
  expect(page.sights.at(-1)).toBe("silent");
});

it("asks for nothing after its end, and an answer that comes then counts for nothing", () => {
  const camera = cameraOf("stream");
  camera.start();
  camera.stop();
  page.arrive();
  vi.advanceTimersByTime(10 * RENEWAL);
  expect([page.asked.length, page.open, page.shown]).toEqual([1, false, false]);
  camera.start();
  page.arrive();
  expect([page.asked.length, page.shown]).toEqual([2, true]);
});
