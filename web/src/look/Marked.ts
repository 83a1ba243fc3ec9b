import { h, type FunctionalComponent } from "vue";

/** A text of the service: what stands between backticks in it, as commands do, is shown as code. */
const Marked: FunctionalComponent<{ text: string }> = ({ text }) => text.split("`").map((part, i) => (i % 2 === 1 ? h("code", part) : part));

Marked.props = ["text"];
export default Marked;
