import { words } from "./index.ts";

export const QUEUE = words({
  interruptedTitle: ["A job was interrupted", "Un trabajo se interrumpió"],
  interruptedAt: ["Job {job} ({name}) was interrupted at step {index}: {step}.", "El trabajo {job} ({name}) se interrumpió en el paso {index}: {step}."],
  interruptedBetween: ["Job {job} ({name}) was interrupted between two steps.", "El trabajo {job} ({name}) se interrumpió entre dos pasos."],
  nothingMoves: ["Nothing moves before you decide. Look at the robot first.", "Nada se mueve antes de que usted decida. Mire primero el robot."],
  partInGripper: ["Is there a part in the gripper?", "¿Hay una pieza en la pinza?"],
  whatToDo: ["What should happen to the job?", "¿Qué debe pasar con el trabajo?"],
  resumeChoice: ["Continue after the interrupted step", "Continuar después del paso interrumpido"],
  redoChoice: ["Do the interrupted step again", "Repetir el paso interrumpido"],
  skipChoice: ["Skip the interrupted step", "Omitir el paso interrumpido"],
  abortChoice: ["Give the job up", "Abandonar el trabajo"],
  later: ["Decide later", "Decidir después"],
  decide: ["Decide", "Decidir"],
});
