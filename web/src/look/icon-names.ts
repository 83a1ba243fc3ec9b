/** The icons of lucide that the dashboard uses. */
export const ICONS = [
  "activity", "arrow-down", "arrow-left", "arrow-right", "arrow-up", "bot", "box", "check", "chevron-down", "chevron-right",
  "circle-alert", "circle-question-mark", "circle-x", "clock", "copy", "crosshair", "download", "eye", "gamepad-2", "gauge",
  "graduation-cap", "grip-vertical", "hand", "hand-grab", "house", "joystick", "keyboard", "languages", "list-ordered", "lock", "map-pin", "log-in",
  "log-out", "moon", "move", "octagon-x", "pause", "pencil", "play", "plus", "qr-code", "radio", "refresh-cw", "rotate-ccw", "rotate-ccw-clock",
  "rotate-cw", "ruler", "save", "search", "settings", "skip-forward", "step-forward", "sun", "terminal", "trash",
  "triangle-alert", "undo-2", "upload", "user", "users", "video", "wifi-off", "wrench", "x", "zoom-in",
] as const;

export type IconName = (typeof ICONS)[number];
