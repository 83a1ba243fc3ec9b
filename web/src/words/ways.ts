import { words, type Words } from "./index.ts";

/** The ways to interrupt a job: every button on every page has these words. */
export const WAYS = words({
  pauseNow: ["Pause now", "Pausar ya"],
  pauseStep: ["Pause after the step", "Pausar tras el paso"],
  skip: ["Skip the step", "Omitir el paso"],
  cancelJob: ["Cancel the job", "Cancelar el trabajo"],
  about: ["What do these buttons do?", "¿Qué hacen estos botones?"],
});

/** The effect of each of them on the job; Stop has its label in COMMON. */
export const ABOUT = words({
  pauseNow: [
    "The robot brakes on its path and waits there. Resume continues the same motion.",
    "El robot frena sobre su trayectoria y espera allí. Reanudar continúa el mismo movimiento.",
  ],
  pauseStep: ["The robot ends its step, then waits. Resume begins the next step.", "El robot termina su paso y espera. Reanudar comienza el paso siguiente."],
  skip: ["A paused job leaves out its next step. Resume goes on with the step after it.", "Un trabajo en pausa omite su paso siguiente. Reanudar continúa con el paso que viene después."],
  cancelJob: [
    "The job ends, and the robot brakes if it moves. The next job begins, unless the queue is paused.",
    "El trabajo termina, y el robot frena si se mueve. El trabajo siguiente comienza, salvo que la cola esté en pausa.",
  ],
  stop: [
    "All motion brakes at once, and the running job ends as cancelled. Waiting jobs stay, and the queue is paused.",
    "Todo movimiento frena enseguida, y el trabajo en curso termina cancelado. Los trabajos en espera se conservan, y la cola queda en pausa.",
  ],
}) satisfies Record<string, Words>;
