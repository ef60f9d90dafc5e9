// Minimal client of WebDriver BiDi (https://w3c.github.io/webdriver-bidi/), for one page.
//
// Firefox implements the protocol, JSON over a WebSocket, natively. Existing libraries depend on seventy
// packages, or on a driver that is not available everywhere.
import { spawn } from 'node:child_process'
import { mkdtemp, rm, writeFile } from 'node:fs/promises'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import WebSocket from 'ws'

const TIMEOUT_MS = 30_000

/** Start a headless browser, call `use` with its page, and stop the browser. */
export async function withPage(executable, preferences, use) {
  const profile = await mkdtemp(join(tmpdir(), 'gaitswarm-firefox-'))
  const lines = Object.entries(preferences).map(
    ([name, value]) => `user_pref(${JSON.stringify(name)}, ${JSON.stringify(value)});\n`,
  )
  await writeFile(join(profile, 'user.js'), lines.join(''))
  const flags = ['--headless', '--no-remote', '--profile', profile, '--remote-debugging-port', '0']
  const browser = spawn(executable, flags, { stdio: ['ignore', 'ignore', 'pipe'] })
  const ended = new Promise((resolve) => browser.on('close', resolve))
  try {
    const page = new Page(await connected(await address(browser)))
    await page.begin()
    await use(page)
  } finally {
    browser.kill()
    await ended
    await rm(profile, { recursive: true, force: true })
  }
}

function address(browser) {
  return new Promise((resolve, reject) => {
    let output = ''
    browser.stderr.on('data', (data) => {
      output += data
      const match = /WebDriver BiDi listening on (ws:\S+)/.exec(output)
      if (match) resolve(`${match[1]}/session`)
    })
    browser.on('error', reject)
    browser.on('close', () => reject(new Error(`the browser exited: ${output}`)))
  })
}

function connected(url) {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(url)
    socket.on('open', () => resolve(socket))
    socket.on('error', reject)
  })
}

/** User actions on a page; collects errors in `problems`. */
class Page {
  problems = []
  #socket
  #pending = new Map()
  #context = ''

  constructor(socket) {
    this.#socket = socket
    socket.on('message', (data) => this.#take(JSON.parse(data)))
    socket.on('close', () => {
      for (const { reject } of this.#pending.values()) reject(new Error('the browser exited'))
    })
  }

  async begin() {
    await this.#send('session.new', { capabilities: {} })
    const { contexts } = await this.#send('browsingContext.getTree', {})
    this.#context = contexts[0].context
    await this.#send('session.subscribe', {
      events: ['log.entryAdded', 'network.responseCompleted'],
    })
  }

  go(url) {
    return this.#send('browsingContext.navigate', { context: this.#context, url, wait: 'complete' })
  }

  resize(width, height) {
    const viewport = { width, height }
    return this.#send('browsingContext.setViewport', { context: this.#context, viewport })
  }

  async picture(path) {
    const { data } = await this.#send('browsingContext.captureScreenshot', {
      context: this.#context,
    })
    await writeFile(path, Buffer.from(data, 'base64'))
  }

  /** Evaluate a function in the page; arguments and result must be JSON. */
  async evaluate(of, ...values) {
    const { result, exceptionDetails } = await this.#send('script.evaluate', {
      expression: `(async () => JSON.stringify(await (${of})(...${JSON.stringify(values)})))()`,
      target: { context: this.#context },
      awaitPromise: true,
    })
    if (exceptionDetails) throw new Error(exceptionDetails.text)
    return result.value === undefined ? undefined : JSON.parse(result.value)
  }

  /** Wait until a function returns a truthy value in the page. */
  async until(what, of, ...values) {
    for (const ends = Date.now() + TIMEOUT_MS; Date.now() < ends; ) {
      const result = await this.evaluate(of, ...values)
      if (result) return result
      await new Promise((resolve) => setTimeout(resolve, 50))
    }
    throw new Error(`timeout waiting for ${what}`)
  }

  /** Click the matching element that starts with this text, or the control that it labels. */
  async click(selector, text = '') {
    const [x, y] = await this.until(`${selector} ${text}`, middle, selector, text)
    const pointer = { type: 'pointer', id: 'mouse' }
    const actions = [
      { type: 'pointerMove', x, y },
      { type: 'pointerDown', button: 0 },
    ]
    await this.#perform({ ...pointer, actions: [...actions, { type: 'pointerUp', button: 0 }] })
  }

  /** Replace the text of the field with this label. */
  async fill(label, text) {
    await this.click('label', label)
    const keys = (type) => (value) => ({ type, value })
    const all = [keys('keyDown')('\uE009'), ...pressed('a'), keys('keyUp')('\uE009')]
    const actions = [...all, ...[...text].flatMap(pressed)]
    await this.#perform({ type: 'key', id: 'keyboard', actions })
  }

  async #perform(source) {
    await this.#send('input.performActions', { context: this.#context, actions: [source] })
  }

  #send(method, params) {
    const id = this.#pending.size
    return new Promise((resolve, reject) => {
      this.#pending.set(id, { resolve, reject })
      this.#socket.send(JSON.stringify({ id, method, params }))
    })
  }

  #take(message) {
    if (message.type === 'success') this.#pending.get(message.id).resolve(message.result)
    else if (message.type === 'error')
      this.#pending.get(message.id).reject(new Error(`${message.error}: ${message.message}`))
    else if (message.method === 'log.entryAdded' && message.params.level === 'error')
      this.problems.push(`console: ${message.params.text}`)
    else if (message.method === 'network.responseCompleted') {
      const { status, url } = message.params.response
      if (status >= 400) this.problems.push(`${status}: ${url}`)
    }
  }
}

const pressed = (key) => [
  { type: 'keyDown', value: key },
  { type: 'keyUp', value: key },
]

/* Evaluated in the page. */
function middle(selector, text) {
  const starts = (element) => element.textContent.trim().startsWith(text)
  const match = [...document.querySelectorAll(selector)].find(starts)
  const element = match?.control ?? match
  if (!element || element.disabled) return null
  element.scrollIntoView({ block: 'center', behavior: 'instant' })
  const box = element.getBoundingClientRect()
  return [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)]
}
