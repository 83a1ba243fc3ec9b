import { ref, shallowRef } from "vue";
import type { State, StopReport } from "../generated/api.ts";
import { Unreachable } from "../stream/stream.ts";

/** A stop that is not answered within this time has failed for the person who waits [ms]; it may still arrive. */
export const PATIENCE = 5_000;

/**
 * The progress of the newest stop, for the button and for the sentence above every page. An answer that comes late replaces
 * the failure. The sentence of a stop that arrived ends when the robot has come to rest and moves again.
 */
export class Stopping {
  readonly stage = ref<"idle" | "sent" | "done" | "failed">("idle");
  readonly report = shallowRef<StopReport | null>(null);
  readonly failure = ref("");
  private newest = 0;
  private rested = false;

  /** `present` returns the newest state, null for none. */
  constructor(private readonly present: () => State | null) {}

  /** Follows a stop that was sent in one or more ways: the first answer counts. `reasonOf` puts a failure into words. */
  async follow(ways: readonly Promise<StopReport>[], reasonOf: (error: unknown) => string): Promise<void> {
    const mine = ++this.newest;
    this.stage.value = "sent";
    const late = setTimeout(() => this.failed(mine, reasonOf(new Unreachable())), PATIENCE);
    try {
      const report = await Promise.any(ways);
      if (mine === this.newest) this.done(report);
    } catch (error) {
      this.failed(mine, reasonOf((error as AggregateError).errors[0]));
    } finally {
      clearTimeout(late);
    }
  }

  /** Looks at the newest state. */
  look(): void {
    const now = this.present();
    if (this.stage.value !== "done" || now === null || now.mode === "stopping") return;
    if (!now.moving) this.rested = true;
    else if (this.rested) this.stage.value = "idle";
  }

  private done(report: StopReport): void {
    this.report.value = report;
    this.rested = false;
    this.stage.value = "done";
    this.look();
  }

  private failed(mine: number, reason: string): void {
    if (mine !== this.newest) return;
    this.failure.value = reason;
    this.stage.value = "failed";
  }
}
