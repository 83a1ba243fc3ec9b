import type { CameraConfig } from "../../generated/api.ts";

/** The state of the camera: no answer yet, live pictures, or no picture any more. */
export type Sight = "opening" | "live" | "silent";

/** A camera that sends no picture for this long does not answer [ms]. */
export const PATIENCE = 5_000;

/** A stream is requested again after this time [ms]: browsers report neither its end nor that it stands still. */
export const RENEWAL = 10_000;

/** Snapshots are requested at most this often, and never before the last answer [ms]. */
export const PERIOD = 500;

/** Pauses after the first failure and after many [ms]. */
export const FIRST_PAUSE = 1_000;
export const LONGEST_PAUSE = 15_000;

/** Pictures are kept and drawn up to this width [px]. */
const WIDEST = 1280;

/** The part of an image element that the camera needs. */
export type Picture = Pick<HTMLImageElement, "src" | "onload" | "onerror" | "naturalWidth" | "naturalHeight" | "removeAttribute">;

/** The elements that show the pictures: `picture` is shown while a stream runs, `still` below it holds the last picture. */
export interface Screen {
  picture: Picture;
  still: HTMLCanvasElement;
  /** Whether `picture` is to be seen. */
  reveal(shown: boolean): void;
  told(sight: Sight): void;
}

/** Returns an address that no cache knows. */
export function fresh(url: string, number: number): string {
  return `${url}${url.includes("?") ? "&" : "?"}_=${number}`;
}

/**
 * Shows a camera, with one request at a time. A stream is closed and requested again from time to time, and meanwhile its
 * last picture stays: so a stream that ended or hangs is noticed. A camera that does not answer is asked again, ever less
 * often.
 */
export class Camera {
  private timer: ReturnType<typeof setTimeout> | undefined;
  private running = false;
  private flowing = false;
  private began = 0;
  private number = Date.now();
  private pause = FIRST_PAUSE;

  constructor(
    private readonly camera: CameraConfig,
    private readonly screen: Screen,
  ) {}

  start(): void {
    if (this.running) return;
    this.running = true;
    this.screen.told("opening");
    this.request();
  }

  /** Ends the request under way. The last picture stays. */
  stop(): void {
    this.running = false;
    this.close();
  }

  private request(): void {
    this.close();
    const { picture } = this.screen;
    picture.onload = () => this.arrived();
    picture.onerror = () => this.failed();
    this.began = performance.now();
    this.timer = setTimeout(() => this.failed(), PATIENCE);
    picture.src = fresh(this.camera.url, ++this.number);
  }

  private arrived(): void {
    if (!this.running) return;
    this.pause = FIRST_PAUSE;
    if (this.camera.kind === "stream") {
      if (this.flowing) return; // some browsers report each picture of a stream
      this.flowing = true;
      this.screen.reveal(true);
      this.next(RENEWAL);
    } else {
      this.keep();
      this.next(this.began + PERIOD - performance.now());
    }
    this.screen.told("live");
  }

  private failed(): void {
    this.close();
    this.screen.told("silent");
    this.next(this.pause);
    this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
  }

  private next(wait: number): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.request(), Math.max(0, wait));
  }

  private close(): void {
    clearTimeout(this.timer);
    const { picture } = this.screen;
    if (this.flowing) this.keep();
    this.flowing = false;
    this.screen.reveal(false);
    picture.onload = picture.onerror = null;
    picture.removeAttribute("src");
  }

  /** Draws the present picture into the still. */
  private keep(): void {
    const { picture, still } = this.screen;
    const { naturalWidth: width, naturalHeight: height } = picture;
    if (width === 0 || height === 0) return;
    const scale = Math.min(1, WIDEST / width);
    const [wide, high] = [Math.round(width * scale), Math.round(height * scale)];
    if (still.width !== wide || still.height !== high) [still.width, still.height] = [wide, high];
    still.getContext("2d")?.drawImage(picture as HTMLImageElement, 0, 0, wide, high);
  }
}
