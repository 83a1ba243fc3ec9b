import { createApp } from "vue";
import App from "./App.vue";
import { listenForStop } from "./drive/stop-keys.ts";
import "./look/tokens.css";
import "./look/base.css";
import { apply } from "./look/theme.ts";
import { start } from "./state/robot.ts";
import { language, setLanguage } from "./words/index.ts";

apply();
setLanguage(language.value);
createApp(App).mount("#app");
start();
listenForStop();
