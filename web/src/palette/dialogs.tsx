/** Command palette and keyboard help. */

import { useEffect, useId, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { useResource } from '../api/resource'
import { Check } from '../components/fields/controls'
import { navigate } from '../router/navigation'
import { jobPath } from '../router/routes'
import { useManual } from '../session/session'
import { toggleTheme } from '../theme'
import type { Shown } from './keys'
import './palette.css'
import { type Entry, matchingEntries, SHORTCUTS, shortcutsOn, switchShortcuts } from './shortcuts'

const MOST_JOBS = 8
const PAUSE_MS = 150

const MANUAL: Entry = {
  key: 'manual',
  label: 'Manual',
  kind: 'page',
  run: () => location.assign('/manual'),
}

export interface DialogsProps {
  readonly shown: Exclude<Shown, null>
  readonly onShow: (shown: Shown) => void
}

export default function Dialogs({ shown, onShow }: DialogsProps) {
  const dialog = useRef<HTMLDialogElement>(null)
  useEffect(() => {
    if (!dialog.current?.open) dialog.current?.showModal()
  }, [])
  const close = () => dialog.current?.close()
  return (
    <dialog
      ref={dialog}
      class="palette"
      aria-label={shown === 'palette' ? 'Find' : 'Keyboard shortcuts'}
      onClose={() => onShow(null)}
    >
      {shown === 'palette' ? (
        <Palette onClose={close} onHelp={() => onShow('help')} />
      ) : (
        <Help onClose={close} />
      )}
    </dialog>
  )
}

function Palette({ onClose, onHelp }: { onClose: () => void; onHelp: () => void }) {
  const [text, setText] = useState('')
  const [active, setActive] = useState(0)
  const [pageEntries] = useState(entriesOfPage)
  const id = useId()
  const search = text.trim()
  const manual = useManual()
  const jobs = useResource(
    `palette ${search}`,
    (signal) =>
      get('/v1/jobs', { query: { search: search || undefined, limit: MOST_JOBS }, signal }),
    { keep: true, pause: search === '' ? 0 : PAUSE_MS },
  )
  const pages = [
    ...SHORTCUTS.flatMap(({ words, action }): Entry[] =>
      action.kind === 'go'
        ? [{ key: words, label: words, kind: 'page', run: () => navigate(action.href) }]
        : [],
    ),
    {
      key: 'own robot',
      label: 'Custom robot from a URDF',
      kind: 'page',
      run: () => navigate('/jobs/new?robot=own'),
    },
    { key: 'api', label: 'API', kind: 'page', run: () => location.assign('/docs') },
    ...(manual ? [MANUAL] : []),
    { key: 'theme', label: 'Light or dark', kind: 'command', run: toggleTheme },
    { key: 'help', label: 'Keyboard shortcuts', kind: 'command', run: onHelp },
  ]
  const isNamed = (job: { id: string }) => Number(job.id === search)
  const found = [...(jobs.data?.items ?? [])].sort((a, b) => isNamed(b) - isNamed(a))
  const listed = found.map(
    (job): Entry => ({
      key: `job ${job.id}`,
      label: job.name || job.id,
      kind: `job ${job.id}, ${job.state}`,
      run: () => navigate(jobPath(job.id)),
    }),
  )
  const entries = [...matchingEntries([...pageEntries, ...pages], text), ...listed]
  const at = Math.min(active, entries.length - 1)
  const choose = (entry: Entry | undefined) => {
    if (!entry) return
    if (entry.key !== 'help') onClose()
    entry.run()
  }
  const press = (event: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key]
    if (step) setActive((at + step + entries.length) % Math.max(1, entries.length))
    else if (event.key === 'Enter') choose(entries[at])
    else return
    event.preventDefault()
  }
  useEffect(() => document.getElementById(`${id}-${at}`)?.scrollIntoView({ block: 'nearest' }))
  return (
    <>
      <input
        type="text"
        role="combobox"
        aria-label="Find pages, jobs and commands"
        aria-expanded="true"
        aria-autocomplete="list"
        aria-controls={id}
        aria-activedescendant={at >= 0 ? `${id}-${at}` : undefined}
        placeholder="Pages, jobs, commands"
        autocomplete="off"
        value={text}
        onInput={(event) => {
          setText(event.currentTarget.value)
          setActive(0)
        }}
        onKeyDown={press}
      />
      <div role="listbox" id={id} aria-label="Matches">
        {entries.map((entry, k) => (
          // biome-ignore lint/a11y/useKeyWithClickEvents: the input handles keys
          // biome-ignore lint/a11y/useFocusableInteractive: the input keeps the focus
          <div
            key={entry.key}
            id={`${id}-${k}`}
            role="option"
            aria-selected={k === at}
            onClick={() => choose(entry)}
          >
            <span>{entry.label}</span>
            <span class="muted small">{entry.kind}</span>
          </div>
        ))}
      </div>
      <p class="muted small" role="status">
        {jobs.error !== null
          ? `Could not search jobs: ${jobs.error.message}`
          : entries.length === 0 && 'No matches.'}
      </p>
    </>
  )
}

function Help({ onClose }: { onClose: () => void }) {
  const [on, setOn] = useState(shortcutsOn)
  return (
    <>
      <h2>Keyboard shortcuts</h2>
      <dl class="keys">
        <div>
          <dt>
            <kbd>Ctrl K</kbd> or <kbd>⌘ K</kbd>
          </dt>
          <dd>Find pages, jobs and commands</dd>
        </div>
        {SHORTCUTS.map(({ key, words }) => (
          <div key={key}>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{words}</dd>
          </div>
        ))}
      </dl>
      <Check
        small={false}
        label="enable single-key shortcuts"
        checked={on}
        onChange={(next) => {
          switchShortcuts(next)
          setOn(next)
        }}
      />
      <div class="actions">
        <button type="button" onClick={onClose}>
          Close
        </button>
      </div>
    </>
  )
}

/** Commands and tabs of the open job, taken from its buttons and links. */
function entriesOfPage(): readonly Entry[] {
  const offered = (selector: string, kind: string) =>
    [...document.querySelectorAll<HTMLElement>(selector)].map((element, k): Entry => {
      const label = element.textContent?.trim() ?? ''
      return { key: `${kind} ${k}`, label, kind, run: () => element.click() }
    })
  return [
    ...offered('main .actions > .row > button, main .actions [role=menuitem]', 'this job'),
    ...offered('main :is(nav.tabs, nav.sections) > a', 'part of this job'),
  ]
}
