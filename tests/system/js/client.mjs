// What a program with roslib does at our endpoint, said as JSON, a line each: node client.mjs URL
import { Action, ActionClient, Goal, Param, Ros, Service, Topic } from "roslib";

const tell = (name, value) => console.log(JSON.stringify({ [name]: value }));
const primitive = (command, x = 0, y = 0, z = 0) => ({ command, target: { x, y, z }, open: false });
const asked = (ros, name, ...args) => new Promise((done, failed) => ros[name](...args, done, failed));

const connected = (url) =>
  new Promise((done, failed) => {
    const ros = new Ros({ url });
    ros.on("connection", () => done(ros));
    ros.on("error", failed);
  });

// The next message of a topic; `begin` is called until there is one, for a real graph connects in its own time.
const told = (topic, begin) =>
  new Promise((done) => {
    const again = begin && setInterval(begin, 100);
    topic.subscribe((message) => {
      clearInterval(again);
      topic.unsubscribe();
      done(message);
    });
    begin?.();
  });

const called = (ros, name, type, request) =>
  new Promise((done, failed) => new Service({ ros, name, serviceType: type }).callService(request, done, failed));

async function ask(ros) {
  tell("topics", await asked(ros, "getTopics"));
  tell("topic type", await asked(ros, "getTopicType", "/maya_position"));
  tell("topics for type", await asked(ros, "getTopicsForType", "geometry_msgs/Point"));
  tell("raw", (await asked(ros, "getTopicsAndRawTypes")).typedefs_full_text.length > 0);
  tell("services", await asked(ros, "getServices"));
  tell("service type", await asked(ros, "getServiceType", "/maya_command"));
  tell("services for type", await asked(ros, "getServicesForType", "maya_robot/MayaCommand"));
  tell("request", (await asked(ros, "getServiceRequestDetails", "maya_robot/MayaCommand")).typedefs[0].fieldnames);
  tell("response", (await asked(ros, "getServiceResponseDetails", "maya_robot/MayaCommand")).typedefs[0].fieldnames);
  const details = await asked(ros, "getMessageDetails", "maya_robot/MayaPrimitive");
  tell("message", ros.decodeTypeDefs(details));
  tell("nodes", await asked(ros, "getNodes"));
  tell("action servers", await asked(ros, "getActionServers"));
  const mine = new Param({ ros, name: "/mine/limit" });
  await new Promise((done, failed) => mine.set({ a: [1, 2.5, "x"] }, done, failed));
  tell("param", await new Promise((done, failed) => mine.get(done, failed)));
  tell("params", (await asked(ros, "getParams")).filter((name) => name.startsWith("/mine")));
  await new Promise((done, failed) => mine.delete(done, failed));
}

async function topics(ros) {
  for (const compression of ["none", "png", "cbor", "cbor-raw"]) {
    // A topic each: a message to the one before may still be on its way.
    const topic = { ros, name: `/chatter/${compression.replace("-", "_")}`, messageType: "std_msgs/String" };
    const there = new Topic(topic);
    there.advertise();
    const here = new Topic({ ...topic, compression });
    const first = await told(here, () => there.publish({ data: `äöü ${compression}` }));
    tell(compression, first.bytes ? Buffer.from(first.bytes).toString("utf8", 4) : first.data);
  }
  const raw = new Topic({ ros, name: "/numbers", messageType: "std_msgs/Float64MultiArray", compression: "cbor" });
  const numbers = new Topic({ ros, name: "/numbers", messageType: "std_msgs/Float64MultiArray" });
  tell("numbers", Array.from((await told(raw, () => numbers.publish({ data: [1.5, -2, 3e300] }))).data));
  const real = new Topic({ ros, name: "/real", messageType: "std_msgs/Float64", compression: "cbor" });
  tell("no number", Number.isNaN((await told(real, () => real.publish({ data: null }))).data));
  const event = await told(new Topic({ ros, name: "/maya_event", messageType: "std_msgs/String" }));
  tell("event", event.data.split(" ")[0]);
}

async function services(ros) {
  const mine = new Service({ ros, name: "/mine", serviceType: "std_srvs/SetBool" });
  await mine.advertise((request, response) => {
    response.success = request.data;
    response.message = "by roslib";
    return true;
  });
  tell("own service", await called(ros, "/mine", "std_srvs/SetBool", { data: true }));
  await mine.unadvertise();
  tell("nobody", await called(ros, "/nobody", "std_srvs/SetBool", {}).catch((refused) => refused));
}

const requested = (client, goalMessage, onFeedback) =>
  new Promise((done) => {
    const goal = new Goal({ actionClient: client, goalMessage });
    goal.on("feedback", (feedback) => onFeedback?.(feedback, goal));
    goal.on("result", done);
    goal.send();
  });

async function move(ros) {
  const kind = "maya_robot/MayaCommand";
  tell("before", await called(ros, "/maya_command", kind, { task: primitive("can_teleop") }));
  const client = new ActionClient({ ros, serverName: "/task", actionName: "maya_robot/TaskAction" });
  const phases = new Set();
  tell("homed", await requested(client, { task: primitive("home") }, (feedback) => phases.add(feedback.phase)));
  tell("phases", [...phases].sort());
  const action = new Action({ ros, name: "/task", actionType: "maya_robot/Task" });
  const done = (task) =>
    new Promise((ended, failed) => action.sendGoal({ task }, ended, (feedback) => phases.add(feedback.phase), failed));
  tell("pick", await done(primitive("pick", 0.41, 1.13, 0.4)));
  tell("place", await called(ros, "/maya_command", kind, { task: primitive("place", 1.18, 0.21, 0.4) }));
  const far = { task: primitive("approach", 0.41, 1.13, 0.4) };
  tell("cancelled", await requested(client, far, (_, goal) => goal.cancel()));
  const refused = await new Promise((ended) => {
    const id = action.sendGoal(far, ended, () => action.cancelGoal(id), ended);
  });
  tell("cancelled goal", refused);
  client.dispose();
}

async function carryOut(ros) {
  const mine = new Action({ ros, name: "/count", actionType: "maya_robot/Task" });
  mine.advertise((goal, id) => {
    mine.sendFeedback(id, { phase: goal.task.command, progress: 0.5 });
    mine.setSucceeded(id, { success: true, message: "counted" });
  });
  const other = new Action({ ros, name: "/count", actionType: "maya_robot/Task" });
  tell("own action", await new Promise((ended, failed) =>
    other.sendGoal({ task: primitive("count") }, ended, () => {}, failed)));
  mine.unadvertise();
}

const ros = await connected(process.argv[2]);
await ask(ros);
await topics(ros);
await services(ros);
await move(ros);
await carryOut(ros);
tell("done", true);
ros.close();
process.exit(0);
