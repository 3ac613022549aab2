// The manifest names what is there, and the language server answers. Needs no VS Code: `node --test`.

'use strict';

const assert = require('node:assert');
const fs = require('node:fs');
const path = require('node:path');
const { test } = require('node:test');
const { spawn } = require('node:child_process');
const { languageServer, renderArguments, runArguments } = require('../server');

const root = path.join(__dirname, '..');
const read = (name) => fs.readFileSync(path.join(root, name), 'utf8');
const manifest = JSON.parse(read('package.json'));

test('every file that the manifest names is there', () => {
  const { languages, grammars } = manifest.contributes;
  const named = [
    manifest.main,
    ...languages.map((language) => language.configuration),
    ...grammars.map((grammar) => grammar.path),
  ];
  for (const name of [...named, 'README.md', 'LICENSE']) {
    assert.ok(fs.statSync(path.join(root, name)).isFile(), name);
  }
});

test('the grammar and the language configuration are those of Imp', () => {
  const [entry] = manifest.contributes.grammars;
  const grammar = JSON.parse(read(entry.path));
  assert.equal(grammar.scopeName, entry.scopeName);
  const visit = (rule) => {
    if (rule.include) {
      assert.ok(grammar.repository[rule.include.slice(1)], rule.include);
    }
    (rule.patterns ?? []).forEach(visit);
  };
  [grammar, ...Object.values(grammar.repository)].forEach(visit);
  const configuration = JSON.parse(read(manifest.contributes.languages[0].configuration));
  assert.equal(configuration.comments.lineComment, '#');
  const { increaseIndentPattern, decreaseIndentPattern } = configuration.indentationRules;
  assert.match('for x in xs {', new RegExp(increaseIndentPattern));
  assert.doesNotMatch('let x = {}', new RegExp(increaseIndentPattern));
  assert.match('    }', new RegExp(decreaseIndentPattern));
  const [rule] = configuration.onEnterRules;
  assert.match('## What it is.', new RegExp(rule.beforeText));
  assert.doesNotMatch('# a note', new RegExp(rule.beforeText));
});

test('each command is registered', () => {
  const source = read('extension.js');
  for (const { command } of manifest.contributes.commands) {
    assert.ok(source.includes(`registerCommand('${command}'`), command);
  }
});

test('the commands are those of the program', () => {
  assert.deepEqual(languageServer('imp'), { command: 'imp', args: ['lsp'] });
  assert.deepEqual(runArguments('a b.imp'), ['run', 'a b.imp']);
  assert.deepEqual(renderArguments('a.imp'), ['render', 'a.imp', '-o', 'a.png']);
  assert.equal(manifest.contributes.configuration.properties['imp.path'].default, 'imp');
});

/** A conversation with a language server over pipes. */
class Conversation {
  constructor({ command, args }) {
    this.process = spawn(command, args, { stdio: ['pipe', 'pipe', 'inherit'] });
    this.ended = new Promise((resolve, reject) => {
      this.process.on('error', reject);
      this.process.on('exit', resolve);
    });
    this.received = Buffer.alloc(0);
    this.waiting = new Map();
    this.process.stdout.on('data', (data) => this.receive(data));
  }

  receive(data) {
    this.received = Buffer.concat([this.received, data]);
    for (;;) {
      const end = this.received.indexOf('\r\n\r\n');
      if (end < 0) {
        return;
      }
      const header = this.received.subarray(0, end).toString();
      const length = Number(/Content-Length: (\d+)/i.exec(header)[1]);
      if (this.received.length < end + 4 + length) {
        return;
      }
      const message = JSON.parse(this.received.subarray(end + 4, end + 4 + length));
      this.received = this.received.subarray(end + 4 + length);
      this.waiting.get(message.id)?.(message);
    }
  }

  send(message) {
    const body = JSON.stringify({ jsonrpc: '2.0', ...message });
    this.process.stdin.write(`Content-Length: ${Buffer.byteLength(body)}\r\n\r\n${body}`);
  }

  request(id, method, params) {
    const answer = new Promise((resolve) => this.waiting.set(id, resolve));
    this.send({ id, method, params });
    return Promise.race([
      answer,
      this.ended.then((code) => Promise.reject(new Error(`the server ended with ${code}`))),
    ]);
  }
}

test('the line behind an open bracket is indented', () => {
  const { indentationRules } = JSON.parse(read('language-configuration.json'));
  const pattern = new RegExp(indentationRules.increaseIndentPattern);
  for (const line of ['test "a" {', 'print("#", [  # b', 'let s = "\\" {" + f(']) {
    assert.ok(pattern.test(line), line);
  }
  for (const line of ['let a = 1', 'test "{"', '# {', 'print("a {"']) {
    assert.ok(!pattern.test(line), line);
  }
});

test(
  'the language server starts, answers and ends',
  { skip: process.env.IMP ? false : 'IMP names no program', timeout: 30_000 },
  async () => {
    const server = new Conversation(languageServer(process.env.IMP));
    const params = { processId: process.pid, rootUri: null, capabilities: {} };
    const { result } = await server.request(1, 'initialize', params);
    assert.ok(result.capabilities.textDocumentSync !== undefined);
    server.send({ method: 'initialized', params: {} });
    const { error } = await server.request(2, 'shutdown');
    assert.equal(error, undefined);
    server.send({ method: 'exit' });
    assert.equal(await server.ended, 0);
  },
);
