import { onUnmounted, readonly, ref, shallowRef } from "vue";

/** Seconds of the robot's clock that pass in one second of playing. */
export const RATES = [1, 4, 16] as const;

/** Numbers in the page change at most this often [ms]. */
const PERIOD = 100;

/**
 * The time in a recording from `begin` to `end` [s]: `now` for pictures, and `shown` for numbers, which changes at most
 * ten times a second.
 */
export function usePlayback(begin: number, end: number) {
  const now = shallowRef(begin);
  const shown = ref(begin);
  const playing = ref(false);
  const rate = ref<(typeof RATES)[number]>(1);
  let asked = 0;
  let before = 0;
  let shownAt = 0;

  function seek(time: number): void {
    now.value = shown.value = Math.min(end, Math.max(begin, time));
  }

  function frame(at: number): void {
    const next = now.value + (Math.max(0, at - before) / 1000) * rate.value;
    before = at;
    now.value = Math.min(end, next);
    if (next >= end) {
      pause();
      return;
    }
    if (at - shownAt >= PERIOD) {
      shownAt = at;
      shown.value = now.value;
    }
    asked = requestAnimationFrame(frame);
  }

  function play(): void {
    if (now.value >= end) seek(begin);
    playing.value = true;
    before = performance.now();
    asked = requestAnimationFrame(frame);
  }

  function pause(): void {
    cancelAnimationFrame(asked);
    playing.value = false;
    shown.value = now.value;
  }

  onUnmounted(() => cancelAnimationFrame(asked));
  return { now: readonly(now), shown: readonly(shown), playing: readonly(playing), rate, seek, toggle: () => (playing.value ? pause() : play()), pause };
}
