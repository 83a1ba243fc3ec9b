BEGIN TRANSACTION;
PRAGMA application_id = 1298233697;
PRAGMA user_version = 1;
CREATE TABLE audit (
    number INTEGER PRIMARY KEY,
    date TEXT NOT NULL, who TEXT NOT NULL, role TEXT NOT NULL, source TEXT NOT NULL,
    operation TEXT NOT NULL, code INTEGER NOT NULL, detail TEXT NOT NULL
);
INSERT INTO "audit" VALUES(1,'2026-03-01T08:00:00Z','ann','operator','cli','submit 1',0,'');
CREATE TABLE bodies (job INTEGER PRIMARY KEY, body TEXT NOT NULL);
INSERT INTO "bodies" VALUES(1,'{"name":"job 1","steps":["home",{"pick":[0.5,1.1]}]}');
INSERT INTO "bodies" VALUES(2,'{"name":"job 2","steps":["home",{"pick":[0.5,1.1]}]}');
INSERT INTO "bodies" VALUES(3,'{"name":"job 3","steps":["home",{"pick":[0.5,1.1]}]}');
CREATE TABLE events (
    number INTEGER PRIMARY KEY,
    run INTEGER NOT NULL, seq INTEGER NOT NULL, date TEXT NOT NULL, time REAL NOT NULL,
    kind TEXT NOT NULL, code INTEGER NOT NULL, detail TEXT NOT NULL
);
INSERT INTO "events" VALUES(1,7,1,'2026-03-01T08:00:00Z',1.0,'job',0,'{"job":1}');
INSERT INTO "events" VALUES(2,7,2,'2026-03-01T08:00:00Z',2.0,'job',0,'{"job":2}');
CREATE TABLE jobs (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL, owner TEXT NOT NULL, source TEXT NOT NULL,
    priority INTEGER NOT NULL, held INTEGER NOT NULL, depends_on TEXT NOT NULL, notes TEXT NOT NULL,
    on_failure TEXT NOT NULL, retries INTEGER NOT NULL, stepwise INTEGER NOT NULL,
    state TEXT NOT NULL, position REAL NOT NULL, submitted TEXT NOT NULL,
    steps INTEGER NOT NULL, done INTEGER NOT NULL, code INTEGER NOT NULL, message TEXT NOT NULL,
    predicted REAL, duration REAL, began TEXT NOT NULL, ended TEXT NOT NULL,
    key TEXT NOT NULL, digest TEXT NOT NULL, proposal INTEGER NOT NULL, approved_by TEXT NOT NULL
);
INSERT INTO "jobs" VALUES(1,'job 1','ann','cli',0,0,'[]','','continue',0,0,'done',1.0,'2026-03-01T08:00:00Z',2,2,0,'',NULL,NULL,'','','','',0,'');
INSERT INTO "jobs" VALUES(2,'job 2','ann','cli',0,0,'[]','','continue',0,0,'running',2.0,'2026-03-01T08:00:00Z',2,1,0,'',NULL,NULL,'','','','',0,'');
INSERT INTO "jobs" VALUES(3,'job 3','ann','cli',0,0,'[]','','continue',0,0,'queued',3.0,'2026-03-01T08:00:00Z',2,0,0,'',NULL,NULL,'','','','',0,'');
CREATE TABLE labels (job INTEGER PRIMARY KEY, words TEXT NOT NULL);
INSERT INTO "labels" VALUES(1,'job 1
');
INSERT INTO "labels" VALUES(2,'job 2
');
INSERT INTO "labels" VALUES(3,'job 3
');
CREATE TABLE meta (name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO "meta" VALUES('run',7);
CREATE TABLE queue (
    one INTEGER PRIMARY KEY CHECK (one = 1),
    paused INTEGER NOT NULL, reason TEXT NOT NULL, "by" TEXT NOT NULL, since TEXT NOT NULL
);
INSERT INTO "queue" VALUES(1,1,'stop','ann','2026-03-01T08:00:00Z');
CREATE TABLE steps (
    job INTEGER NOT NULL, "index" INTEGER NOT NULL, state TEXT NOT NULL, code INTEGER NOT NULL, message TEXT NOT NULL,
    predicted REAL, duration REAL, phase TEXT NOT NULL, "end" TEXT,
    PRIMARY KEY (job, "index")
) WITHOUT ROWID;
INSERT INTO "steps" VALUES(2,1,'done',0,'',NULL,30.5,'','{"a":0.5}');
INSERT INTO "steps" VALUES(2,2,'running',0,'',NULL,NULL,'down',NULL);
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_by_owner ON jobs (owner, state, id);
CREATE UNIQUE INDEX jobs_by_key ON jobs (owner, key) WHERE key <> '';
CREATE UNIQUE INDEX events_by_seq ON events (run, seq);
COMMIT;
