import type { RecordingReason } from "../generated/api.ts";
import { t, words, type Words } from "./index.ts";

/** Words that stand in details of events, beside the states of jobs. */
export const DETAILS = words({
  taken: ["taken", "tomado"],
  released: ["released", "soltado"],
  expired: ["expired", "caducado"],
  "handed over": ["handed over", "cedido"],
  offered: ["offered", "ofrecido"],
  asked: ["asked for", "pedido"],
  broken: ["taken away by an administrator", "quitado por un administrador"],
  "signed out": ["signed out", "sesión cerrada"],
  pausing: ["pauses", "se pone en pausa"],
  failing: ["it cannot be written", "no se puede escribir"],
  working: ["it can be written again", "se puede escribir de nuevo"],
});

/** Why a recording was saved. */
export const REASONS: Record<RecordingReason, Words> = {
  asked: ["asked for", "a petición"],
  fault: ["fault", "fallo"],
  limit: ["limit switch", "final de carrera"],
  estop: ["emergency stop", "parada de emergencia"],
  disconnected: ["connection lost", "conexión perdida"],
  crash: ["defect of the program", "defecto del programa"],
};

/** Returns the reason of a recording in words. */
export function reasonText(reason: string): string {
  const known = REASONS[reason as RecordingReason] as Words | undefined;
  return known === undefined ? reason : t(known);
}
