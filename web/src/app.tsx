/** Frame of every page: header, navigation and routing. */

import { useEffect, useLayoutEffect, useRef } from 'preact/hooks'
import { Empty } from './components/feedback'
import icon from './icon.svg'
import { JobsPage } from './jobs/page'
import { Keys } from './palette/keys'
import { forgetIgnored, IgnoredNotice } from './router/ignored'
import { lazyPage } from './router/lazy-page'
import { usePlace } from './router/navigation'
import { type Route, routeOf } from './router/routes'
import { useManual, useUnauthorized } from './session/session'
import { SignIn } from './session/sign-in'
import { toggleTheme, useTheme } from './theme'
import { setTitle } from './title'

const NewJobPage = lazyPage('the form', () => import('./submission/page'))
const JobPage = lazyPage('the job', () => import('./job/page'))
const ComparePage = lazyPage('the comparison', () => import('./compare/page'))
const WalkPage = lazyPage('the walk', () => import('./walk/page'))
const ControllerPage = lazyPage('the controller', () => import('./controller/page'))

const LINKS = [
  { page: 'jobs', href: '/jobs', label: 'Jobs' },
  { page: 'new-job', href: '/jobs/new', label: 'New job' },
  { page: 'walk', href: '/walk', label: 'Walk' },
  { page: 'controller', href: '/controller', label: 'Controller' },
] as const

/** Titles until a page sets its own. */
const TITLES: Readonly<Record<Route['page'], string>> = {
  jobs: 'Jobs',
  'new-job': 'New job',
  job: 'Job',
  compare: 'Compared jobs',
  walk: 'Walk',
  controller: 'Controller',
  'not-found': 'Page not found',
}

export function App() {
  const place = usePlace()
  const route = routeOf(place.path)
  const unauthorized = useUnauthorized()
  const manual = useManual()
  const identity = 'id' in route ? `${route.page} ${route.id}` : route.page
  return (
    <>
      <a class="skip-link" href="#main">
        Skip to content
      </a>
      <header class="masthead">
        <a class="brand" href="/jobs" aria-label="gaitswarm, jobs">
          <img src={icon} alt="" width="22" height="22" />
          <span>gaitswarm</span>
        </a>
        <nav aria-label="Main">
          {LINKS.map((link) => (
            <a
              key={link.page}
              href={link.href}
              aria-current={isUnder(route, link.page) ? 'page' : undefined}
            >
              {link.label}
            </a>
          ))}
          <a href="/docs">API</a>
          {manual && <a href="/manual">Manual</a>}
        </nav>
        <Keys />
        <ThemeToggle />
      </header>
      {unauthorized ? (
        <main id="main">
          <SignIn />
        </main>
      ) : (
        <Main key={identity} route={route} />
      )}
    </>
  )
}

/** The page; takes the focus after navigation, for keyboards and screen readers. */
function Main({ route }: { route: Route }) {
  const main = useRef<HTMLElement>(null)
  // A layout effect runs before the effects of the page, which may set another title.
  useLayoutEffect(() => setTitle(TITLES[route.page]), [route.page])
  useEffect(() => {
    if (navigated) main.current?.focus({ preventScroll: true })
    navigated = true
    return forgetIgnored
  }, [route.page])
  return (
    <main id="main" tabIndex={-1} ref={main} data-page={route.page}>
      <IgnoredNotice />
      <Page route={route} />
    </main>
  )
}

let navigated = false

function Page({ route }: { route: Route }) {
  switch (route.page) {
    case 'jobs':
      return <JobsPage />
    case 'new-job':
      return <NewJobPage />
    case 'job':
      return <JobPage id={route.id} tab={route.tab} />
    case 'compare':
      return <ComparePage />
    case 'walk':
      return <WalkPage />
    case 'controller':
      return <ControllerPage />
    case 'not-found':
      return (
        <Empty title="Page not found">
          <p>
            Go to the <a href="/jobs">list of jobs</a>.
          </p>
        </Empty>
      )
  }
}

function ThemeToggle() {
  const theme = useTheme()
  const other = theme === 'dark' ? 'light' : 'dark'
  return (
    <button
      type="button"
      class="plain compact"
      onClick={toggleTheme}
      aria-label={`Show in ${other} colours`}
    >
      {other === 'dark' ? 'Dark' : 'Light'}
    </button>
  )
}

function isUnder(route: Route, page: Route['page']): boolean {
  const under: readonly Route['page'][] = ['job', 'compare']
  return route.page === page || (page === 'jobs' && under.includes(route.page))
}
