/** The icons of lucide that the dashboard uses. */
export const ICONS = [
  "activity", "arrow-down", "arrow-left", "arrow-right", "arrow-up", "bell", "bot", "box", "check", "chevron-down", "chevron-right",
  "circle-alert", "circle-question-mark", "clock", "copy", "crosshair", "download", "eye", "folder-open", "gamepad-2", "gauge",
  "graduation-cap", "grip-vertical", "hand", "house", "joystick", "keyboard", "languages", "list-ordered", "lock", "map-pin", "log-in",
  "log-out", "moon", "move", "octagon-x", "pause", "pencil", "play", "plus", "qr-code", "radio", "refresh-cw", "rotate-ccw", "rotate-ccw-clock",
  "rotate-cw", "ruler", "save", "search", "settings", "skip-forward", "snowflake", "step-forward", "sun", "terminal", "text-cursor-input", "trash",
  "triangle-alert", "undo-2", "user", "users", "video", "wifi-off", "wrench", "x",
] as const;

export type IconName = (typeof ICONS)[number];
